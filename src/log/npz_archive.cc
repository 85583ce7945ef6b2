#include "src/log/npz_archive.h"

#include <fmt/format.h>
#include <zlib.h>

namespace gapscope {
namespace {

constexpr std::size_t kAlign = 64;
constexpr std::uint16_t kVersion = 20, kFirstOfMay1980 = 161;

// Little-endian, as this program's platforms are (zip.cc checks it).
template <class T>
void AppendNumber(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

// An array's bytes behind numpy's header (numpy.lib.format, version 1).
std::string NpyOf(const char* type, const std::vector<std::size_t>& shape, const void* data, std::size_t bytes) {
  std::string sizes;
  for (const std::size_t size : shape) sizes += fmt::format("{}, ", size);
  std::string head = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, sizes);
  head.append(kAlign - 1 - (10 + head.size()) % kAlign, ' ');
  head += '\n';
  std::string npy("\x93NUMPY\x01\x00", 8);
  AppendNumber(static_cast<std::uint16_t>(head.size()), &npy);
  npy += head;
  npy.append(static_cast<const char*>(data), bytes);
  return npy;
}

}  // namespace

void NpzArchive::Add(const std::string& name, const std::vector<std::size_t>& shape, std::span<const double> values) {
  AddMember(name + ".npy", NpyOf("<f8", shape, values.data(), values.size_bytes()));
}

void NpzArchive::AddBytes(const std::string& name, const std::string& bytes) {
  AddMember(name + ".npy", NpyOf("|u1", {bytes.size()}, bytes.data(), bytes.size()));
}

// A ZIP archive whose members are stored (PKWARE's APPNOTE, 4.3).
void NpzArchive::AddMember(const std::string& name, const std::string& data) {
  const auto offset = static_cast<std::uint32_t>(bytes_.size());
  std::string entry;
  for (const std::uint16_t field : {kVersion, std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0}, kFirstOfMay1980})
    AppendNumber(field, &entry);
  AppendNumber(static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size())),
               &entry);
  for (int k = 0; k < 2; ++k) AppendNumber(static_cast<std::uint32_t>(data.size()), &entry);
  AppendNumber(static_cast<std::uint16_t>(name.size()), &entry);
  AppendNumber(std::uint16_t{0}, &entry);
  bytes_ += "PK\x03\x04" + entry + name + data;
  directory_ += "PK\x01\x02";
  AppendNumber(kVersion, &directory_);
  directory_ += entry + std::string(10, '\0');  // no comment, one disk, no attributes
  AppendNumber(offset, &directory_);
  directory_ += name;
  ++members_;
}

std::string NpzArchive::Finish() {
  const std::size_t start = bytes_.size();
  bytes_ += directory_ + std::string("PK\x05\x06\0\0\0\0", 8);
  for (int k = 0; k < 2; ++k) AppendNumber(members_, &bytes_);
  AppendNumber(static_cast<std::uint32_t>(directory_.size()), &bytes_);
  AppendNumber(static_cast<std::uint32_t>(start), &bytes_);
  AppendNumber(std::uint16_t{0}, &bytes_);
  return std::move(bytes_);
}

}  // namespace gapscope
