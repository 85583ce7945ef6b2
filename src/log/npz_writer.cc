#include "src/log/npz_writer.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cstdint>
#include <nlohmann/json.hpp>

#include "src/core/file.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostWritten = std::size_t{4} << 30;  // beyond it a ZIP archive has another form
constexpr std::size_t kAlign = 64, kMostAround = 512;       // bytes of headers: a multiple; about one member
constexpr std::uint16_t kVersion = 20, kFirstOfMay1980 = 161;

// Little-endian, as this program's platforms are (zip.cc checks it).
template <class T>
void AppendNumber(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

// An array's bytes behind numpy's header (numpy.lib.format, version 1).
std::string NpyOf(const char* type, std::size_t size, const void* data, std::size_t bytes) {
  std::string head = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({},), }}", type, size);
  head.append(kAlign - 1 - (10 + head.size()) % kAlign, ' ');
  head += '\n';
  std::string npy("\x93NUMPY\x01\x00", 8);
  AppendNumber(static_cast<std::uint16_t>(head.size()), &npy);
  npy += head;
  npy.append(static_cast<const char*>(data), bytes);
  return npy;
}

// A ZIP archive whose members are stored (PKWARE's APPNOTE, 4.3).
class StoredZip {
 public:
  void Add(const std::string& name, const std::string& data) {
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

  std::string Finish() {
    const std::size_t start = bytes_.size();
    bytes_ += directory_ + std::string("PK\x05\x06\0\0\0\0", 8);
    for (int k = 0; k < 2; ++k) AppendNumber(members_, &bytes_);
    AppendNumber(static_cast<std::uint32_t>(directory_.size()), &bytes_);
    AppendNumber(static_cast<std::uint32_t>(start), &bytes_);
    AppendNumber(std::uint16_t{0}, &bytes_);
    return std::move(bytes_);
  }

 private:
  std::string bytes_, directory_;
  std::uint16_t members_ = 0;
};

std::string MetaOf(const Log& log) {
  nlohmann::ordered_json json = {{"schema", "gapscope.log/1"},
                                 {"names", nlohmann::ordered_json::array()},
                                 {"units", nlohmann::ordered_json::array()}};
  nlohmann::ordered_json clocks = nlohmann::ordered_json::array();
  bool known = false;
  for (const Column& column : log.columns) {
    json["names"].push_back(column.name);
    json["units"].push_back(column.unit);
    clocks.push_back(column.clock);
    known = known || !column.clock.empty();
  }
  if (known) json["clock"] = std::move(clocks);
  if (!log.time_column.empty()) json["time"] = log.time_column;
  if (log.joined) json["missing"] = "keep";
  json["header"] = nlohmann::ordered_json::object();
  for (const auto& [key, value] : log.header) json["header"][key] = value;
  for (const auto& [key, value] : log.header_text) json["header"][key] = value;
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : log.findings) {
    // What is missing is NaN in the table: who reads that counts it again.
    if (finding.kind == "missing") continue;
    json["findings"].push_back(
        {{"kind", finding.kind}, {"column", finding.column}, {"count", finding.count}, {"text", finding.text}});
  }
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

Status WriteNpz(const std::string& path, const Log& log) {
  const std::string meta = MetaOf(log);
  const std::size_t each = log.rows() * sizeof(double) + kMostAround;
  if (meta.size() + (log.columns.size() + 1) * each > kMostWritten)
    return Error{.what = "a log above 4 GB",
                 .where = log.path,
                 .actual = fmt::format("{} columns of {} rows", log.columns.size(), log.rows()),
                 .cure = "split it, or leave out columns"};
  StoredZip zip;
  zip.Add("meta.npy", NpyOf("|u1", meta.size(), meta.data(), meta.size()));
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    const std::vector<double>& values = log.columns[c].values;
    zip.Add(fmt::format("c{}.npy", c), NpyOf("<f8", values.size(), values.data(), values.size() * sizeof(double)));
  }
  return WriteFile(path, zip.Finish());
}

}  // namespace gapscope
