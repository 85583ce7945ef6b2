#include "src/log/zip_writer.h"

#include <zlib.h>

#include <new>

namespace gapscope {
namespace {

constexpr std::uint16_t kZipVersion = 20, kFirstOfMay1980 = 161, kMethodStored = 0, kMethodDeflated = 8;

// Little-endian, as this program's platforms are (zip.cc checks it).
template <class T>
void AppendZipNumber(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Sizes are below 4 GB.
std::string Deflated(std::string_view data) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, MAX_MEM_LEVEL, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string packed(deflateBound(&stream, data.size()), '\0');
  // zlib does not write to its input.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace

// A local header before each member, and the same in the directory (PKWARE's APPNOTE, 4.3).
void ZipWriter::Add(const std::string& name, std::string_view data, Packing packing) {
  const bool deflated = packing == Packing::kDeflated;
  const std::string storage = deflated ? Deflated(data) : std::string();
  const std::string_view packed = deflated ? storage : data;
  const auto offset = static_cast<std::uint32_t>(bytes_.size());
  std::string entry;
  for (const std::uint16_t field :
       {kZipVersion, std::uint16_t{0}, deflated ? kMethodDeflated : kMethodStored, std::uint16_t{0}, kFirstOfMay1980})
    AppendZipNumber(field, &entry);
  AppendZipNumber(static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size())),
                  &entry);
  AppendZipNumber(static_cast<std::uint32_t>(packed.size()), &entry);
  AppendZipNumber(static_cast<std::uint32_t>(data.size()), &entry);
  AppendZipNumber(static_cast<std::uint16_t>(name.size()), &entry);
  AppendZipNumber(std::uint16_t{0}, &entry);
  bytes_.append("PK\x03\x04").append(entry).append(name).append(packed);
  directory_ += "PK\x01\x02";
  AppendZipNumber(kZipVersion, &directory_);
  directory_ += entry + std::string(10, '\0');  // no comment, one disk, no attributes
  AppendZipNumber(offset, &directory_);
  directory_ += name;
  ++members_;
}

std::string ZipWriter::Finish() {
  const std::size_t start = bytes_.size();
  bytes_ += directory_ + std::string("PK\x05\x06\0\0\0\0", 8);
  for (int k = 0; k < 2; ++k) AppendZipNumber(members_, &bytes_);
  AppendZipNumber(static_cast<std::uint32_t>(directory_.size()), &bytes_);
  AppendZipNumber(static_cast<std::uint32_t>(start), &bytes_);
  AppendZipNumber(std::uint16_t{0}, &bytes_);
  return std::move(bytes_);
}

}  // namespace gapscope
