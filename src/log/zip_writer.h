// A ZIP archive as any tool reads it, its members stored or deflated.
#ifndef GAPSCOPE_LOG_ZIP_WRITER_H_
#define GAPSCOPE_LOG_ZIP_WRITER_H_

#include <cstdint>
#include <string>
#include <string_view>

namespace gapscope {

class ZipWriter {
 public:
  static constexpr std::size_t kMost = std::size_t{4} << 30;  // bytes; beyond it a ZIP archive has another form
  static constexpr std::size_t kMostMembers = 65535;
  enum class Packing { kStored, kDeflated };

  void Add(const std::string& name, std::string_view data, Packing packing);
  std::size_t size() const { return bytes_.size() + directory_.size(); }
  // The archive; nothing may be added after.
  std::string Finish();

 private:
  std::string bytes_, directory_;
  std::uint16_t members_ = 0;
};

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_ZIP_WRITER_H_
