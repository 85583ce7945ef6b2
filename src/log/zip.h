// The members of a ZIP archive in memory, stored or deflated.
#ifndef GAPSCOPE_LOG_ZIP_H_
#define GAPSCOPE_LOG_ZIP_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// One file of an archive, as the archive's directory states it; `packed` lies within the archive's bytes.
struct ZipMember {
  std::string name;
  std::string_view packed;
  std::size_t size = 0;  // unpacked
  std::uint32_t checksum = 0;
  bool deflated = false;
};

// All members, in the order of the directory. Errors: no directory, one that is damaged or points outside of the
// bytes, an encrypted member, another method than stored and deflated, the same name twice, an archive above 4 GB.
Result<std::vector<ZipMember>> ReadZipDirectory(const std::string& path, std::string_view bytes);

// The member's bytes: where they are stored, those of the archive itself; else unpacked into `storage`, of which they
// are then a view. Takes no more memory than `member.size`, which the caller has found acceptable. Errors: damaged
// data, another size than the directory states, a wrong checksum.
Result<std::string_view> Unpack(const std::string& path, const ZipMember& member, std::string* storage);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_ZIP_H_
