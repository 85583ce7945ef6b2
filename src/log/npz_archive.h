// An NPZ archive as numpy.load reads it: arrays of doubles or bytes by name, stored without compression.
#ifndef GAPSCOPE_LOG_NPZ_ARCHIVE_H_
#define GAPSCOPE_LOG_NPZ_ARCHIVE_H_

#include <span>
#include <string>
#include <vector>

#include "src/log/zip_writer.h"

namespace gapscope {

class NpzArchive {
 public:
  static constexpr std::size_t kMost = ZipWriter::kMost;

  // `values` in C order: as many as the product of `shape`.
  void Add(const std::string& name, const std::vector<std::size_t>& shape, std::span<const double> values);
  void AddBytes(const std::string& name, const std::string& bytes);
  // The archive; nothing may be added after.
  std::string Finish() { return zip_.Finish(); }

 private:
  ZipWriter zip_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_NPZ_ARCHIVE_H_
