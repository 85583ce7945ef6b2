#include "src/log/zip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>

#include "src/log/text.h"

namespace gapscope {
namespace {

using namespace std::string_view_literals;

static_assert(std::endian::native == std::endian::little);

// Signatures and sizes of a ZIP file's records (PKWARE's APPNOTE, 4.3).
constexpr std::string_view kEndMark = "PK\x05\x06"sv, kEntryMark = "PK\x01\x02"sv, kLocalMark = "PK\x03\x04"sv;
constexpr std::size_t kEndSize = 22, kEntrySize = 46, kLocalSize = 30, kLongestComment = 65535;
constexpr std::uint32_t kElsewhere = 0xFFFFFFFF;  // the number stands in a ZIP64 record
constexpr std::uint16_t kEncrypted = 1, kStored = 0, kDeflated = 8;

// An unsigned number at an offset that the caller has checked.
template <class T>
T NumberAt(std::string_view bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

Error Damaged(const std::string& path, std::string what, std::string actual) {
  return Error{.what = std::move(what),
               .where = path + ": archive",
               .actual = std::move(actual),
               .allowed = "a whole ZIP archive, as numpy.savez writes it",
               .cure = "was the file cut off, or still being written? Save or copy it again"};
}

Error Unusable(const std::string& path, const std::string& name, std::string what, std::string actual) {
  return Error{.what = std::move(what),
               .where = path + ": array " + Quoted(name),
               .actual = std::move(actual),
               .allowed = "arrays stored or deflated, as numpy.savez and numpy.savez_compressed write them",
               .cure = "save it again with one of them"};
}

// Where the member's own bytes are: behind its local header, whose names and extra fields may differ from the
// directory's.
Result<std::string_view> PackedBytes(const std::string& path, std::string_view bytes, const std::string& name,
                                     std::size_t offset, std::size_t size) {
  if (offset > bytes.size() || bytes.size() - offset < kLocalSize || bytes.substr(offset, 4) != kLocalMark)
    return Damaged(path, "no data where the archive's directory says", fmt::format("{} at {}", Quoted(name), offset));
  const std::size_t head =
      kLocalSize + NumberAt<std::uint16_t>(bytes, offset + 26) + NumberAt<std::uint16_t>(bytes, offset + 28);
  if (bytes.size() - offset < head || bytes.size() - offset - head < size)
    return Damaged(path, "an array that reaches beyond the end of the file",
                   fmt::format("{}, {} bytes at {} of {}", Quoted(name), size, offset, bytes.size()));
  return bytes.substr(offset + head, size);
}

// The entry at `*offset`, which becomes that of the next.
Result<ZipMember> ReadEntry(const std::string& path, std::string_view bytes, std::size_t* offset) {
  const std::string_view entry = bytes.substr(*offset);
  if (entry.size() < kEntrySize || !entry.starts_with(kEntryMark))
    return Damaged(path, "the archive's directory is damaged", fmt::format("no entry at {}", *offset));
  const std::size_t name_size = NumberAt<std::uint16_t>(entry, 28);
  const std::size_t all =
      kEntrySize + name_size + NumberAt<std::uint16_t>(entry, 30) + NumberAt<std::uint16_t>(entry, 32);
  if (entry.size() < all) return Damaged(path, "the archive's directory is damaged", "an entry that is cut off");
  *offset += all;
  ZipMember member{.name = std::string(entry.substr(kEntrySize, name_size)),
                   .packed = {},
                   .size = NumberAt<std::uint32_t>(entry, 24),
                   .checksum = NumberAt<std::uint32_t>(entry, 16)};
  const auto method = NumberAt<std::uint16_t>(entry, 10);
  if (NumberAt<std::uint16_t>(entry, 8) & kEncrypted)
    return Unusable(path, member.name, "an encrypted array", "a password");
  if (method != kStored && method != kDeflated)
    return Unusable(path, member.name, "a packing that is not known", fmt::format("method {}", method));
  const auto packed_size = NumberAt<std::uint32_t>(entry, 20), at = NumberAt<std::uint32_t>(entry, 42);
  if (packed_size == kElsewhere || member.size == kElsewhere || at == kElsewhere)
    return Unusable(path, member.name, "an archive above 4 GB", "ZIP64 sizes");
  member.deflated = method == kDeflated;
  if (!member.deflated && packed_size != member.size)
    return Damaged(path, "two sizes of one stored array",
                   fmt::format("{} and {} bytes of {}", packed_size, member.size, Quoted(member.name)));
  GS_ASSIGN(member.packed, PackedBytes(path, bytes, member.name, at, packed_size));
  return member;
}

}  // namespace

Result<std::vector<ZipMember>> ReadZipDirectory(const std::string& path, std::string_view bytes) {
  const std::size_t from = bytes.size() - std::min(bytes.size(), kEndSize + kLongestComment);
  const std::size_t end = bytes.rfind(kEndMark);
  if (end == std::string_view::npos || end < from || bytes.size() - end < kEndSize)
    return Damaged(path, "the archive has no directory at its end", fmt::format("{} bytes", bytes.size()));
  const std::size_t count = NumberAt<std::uint16_t>(bytes, end + 10);
  std::size_t offset = NumberAt<std::uint32_t>(bytes, end + 16);
  if (offset > end)
    return Damaged(path, "the archive's directory is not where it should be", fmt::format("at {} of {}", offset, end));
  std::vector<ZipMember> members;
  std::set<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    GS_ASSIGN(ZipMember member, ReadEntry(path, bytes.substr(0, end), &offset));
    if (!names.insert(member.name).second) return Unusable(path, member.name, "an array twice in the archive", "two");
    members.push_back(std::move(member));
  }
  return members;
}

Result<std::string_view> Unpack(const std::string& path, const ZipMember& member, std::string* storage) {
  std::string_view unpacked = member.packed;
  if (member.deflated) {
    storage->resize(member.size);
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
    // zlib does not write to its input; sizes are below 4 GB.
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(member.packed.data()));
    stream.avail_in = static_cast<uInt>(member.packed.size());
    Bytef nothing = 0;
    stream.next_out = member.size > 0 ? reinterpret_cast<Bytef*>(storage->data()) : &nothing;
    stream.avail_out = static_cast<uInt>(member.size);
    const int status = inflate(&stream, Z_FINISH);
    const std::size_t written = stream.total_out;
    inflateEnd(&stream);
    if (status != Z_STREAM_END || written != member.size)
      return Damaged(path, "packed data that cannot be unpacked to the size stated",
                     fmt::format("{}: {} of {} bytes", Quoted(member.name), written, member.size));
    unpacked = *storage;
  }
  const auto checksum = crc32_z(0, reinterpret_cast<const Bytef*>(unpacked.data()), unpacked.size());
  if (checksum != member.checksum)
    return Damaged(path, "an array whose checksum is wrong", fmt::format("{}", Quoted(member.name)));
  return unpacked;
}

}  // namespace gapscope
