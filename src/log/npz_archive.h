// An NPZ archive as numpy.load reads it: arrays of doubles or bytes by name, stored without compression.
#ifndef GAPSCOPE_LOG_NPZ_ARCHIVE_H_
#define GAPSCOPE_LOG_NPZ_ARCHIVE_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gapscope {

class NpzArchive {
 public:
  static constexpr std::size_t kMost = std::size_t{4} << 30;  // bytes; beyond it a ZIP archive has another form

  // `values` in C order: as many as the product of `shape`.
  void Add(const std::string& name, const std::vector<std::size_t>& shape, std::span<const double> values);
  void AddBytes(const std::string& name, const std::string& bytes);
  // The archive; nothing may be added after.
  std::string Finish();

 private:
  void AddMember(const std::string& name, const std::string& data);

  std::string bytes_, directory_;
  std::uint16_t members_ = 0;
};

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_NPZ_ARCHIVE_H_
