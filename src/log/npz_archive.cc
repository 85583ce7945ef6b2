#include "src/log/npz_archive.h"

#include <fmt/format.h>

namespace gapscope {
namespace {

constexpr std::size_t kAlign = 64;

// An array's bytes behind numpy's header (numpy.lib.format, version 1).
std::string NpyOf(const char* type, const std::vector<std::size_t>& shape, const void* data, std::size_t bytes) {
  std::string sizes;
  for (const std::size_t size : shape) sizes += fmt::format("{}, ", size);
  std::string head = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, sizes);
  head.append(kAlign - 1 - (10 + head.size()) % kAlign, ' ');
  head += '\n';
  std::string npy("\x93NUMPY\x01\x00", 8);
  const auto head_size = static_cast<std::uint16_t>(head.size());  // little-endian, as zip.cc checks
  npy.append(reinterpret_cast<const char*>(&head_size), sizeof head_size);
  npy += head;
  npy.append(static_cast<const char*>(data), bytes);
  return npy;
}

}  // namespace

void NpzArchive::Add(const std::string& name, const std::vector<std::size_t>& shape, std::span<const double> values) {
  zip_.Add(name + ".npy", NpyOf("<f8", shape, values.data(), values.size_bytes()), ZipWriter::Packing::kStored);
}

void NpzArchive::AddBytes(const std::string& name, const std::string& bytes) {
  zip_.Add(name + ".npy", NpyOf("|u1", {bytes.size()}, bytes.data(), bytes.size()), ZipWriter::Packing::kStored);
}

}  // namespace gapscope
