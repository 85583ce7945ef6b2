// NPZ archives made here, by the formats' descriptions and without the reader's code: ZIP (PKWARE's APPNOTE), NPY
// (numpy.lib.format).
#ifndef GAPSCOPE_TESTS_LOG_NPZ_FIXTURE_H_
#define GAPSCOPE_TESTS_LOG_NPZ_FIXTURE_H_

#include <zlib.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gapscope {

// A number's bytes, the lowest first.
template <class T>
std::string Bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}
template <class T>
std::string BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string NpyOf(const std::string& header, const std::string& data, char version = 1) {
  std::string text = header;
  while ((text.size() + 11) % 64 != 0) text += ' ';
  text += '\n';
  const std::string length =
      version == 1 ? Bytes(static_cast<std::uint16_t>(text.size())) : Bytes(static_cast<std::uint32_t>(text.size()));
  return std::string("\x93NUMPY") + version + '\0' + length + text + data;
}
inline std::string Npy(const std::string& type, const std::string& shape, const std::string& data,
                       bool fortran = false) {
  return NpyOf(
      "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': " + shape + ", }",
      data);
}
inline std::string Npy(const std::vector<double>& values) {
  return Npy("<f8", "(" + std::to_string(values.size()) + ",)", BytesOf(values));
}

inline std::string Deflated(std::string_view bytes) {
  std::string packed(compressBound(static_cast<uLong>(bytes.size())) + 64, '\0');
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

// One member, with what a hostile archive says of it.
struct Member {
  std::string name, data;
  bool deflated = false;
  std::uint32_t claimed_size = 0;  // 0: the true one
  std::uint16_t method = 0, flags = 0;
};

inline std::string Zip(const std::vector<Member>& members) {
  std::string archive, directory;
  for (const Member& m : members) {
    const std::string packed = m.deflated ? Deflated(m.data) : m.data;
    const auto crc = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(m.data.data()), static_cast<uInt>(m.data.size())));
    const auto size = m.claimed_size > 0 ? m.claimed_size : static_cast<std::uint32_t>(m.data.size());
    const std::uint16_t method = m.method > 0 ? m.method : m.deflated ? 8 : 0;
    const std::string shared = Bytes(std::uint16_t{20}) + Bytes(m.flags) + Bytes(method) + Bytes(std::uint32_t{0}) +
                               Bytes(crc) + Bytes(static_cast<std::uint32_t>(packed.size())) + Bytes(size) +
                               Bytes(static_cast<std::uint16_t>(m.name.size()));
    directory += "PK\x01\x02" + Bytes(std::uint16_t{20}) + shared + std::string(12, '\0') +
                 Bytes(static_cast<std::uint32_t>(archive.size())) + m.name;
    archive += "PK\x03\x04" + shared + Bytes(std::uint16_t{0}) + m.name + packed;
  }
  const auto count = static_cast<std::uint16_t>(members.size());
  return archive + directory + "PK\x05\x06" + Bytes(std::uint32_t{0}) + Bytes(count) + Bytes(count) +
         Bytes(static_cast<std::uint32_t>(directory.size())) + Bytes(static_cast<std::uint32_t>(archive.size())) +
         Bytes(std::uint16_t{0});
}

// The table of gapscope.log/1.
inline std::string Table(const std::string& meta, const std::vector<std::vector<double>>& columns,
                         bool deflated = false) {
  std::vector<Member> members = {{"meta.npy", Npy("|u1", "(" + std::to_string(meta.size()) + ",)", meta), deflated}};
  for (std::size_t c = 0; c < columns.size(); ++c)
    members.push_back({"c" + std::to_string(c) + ".npy", Npy(columns[c]), deflated});
  return Zip(members);
}

}  // namespace gapscope

#endif  // GAPSCOPE_TESTS_LOG_NPZ_FIXTURE_H_
