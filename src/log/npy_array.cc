#include "src/log/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include "src/log/text.h"

namespace gapscope {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kMagic = "\x93NUMPY"sv;
constexpr std::size_t kMostAxes = 32;

Error BrokenHeader(const std::string& where, std::string_view header) {
  return Error{.what = "an array's header cannot be read",
               .where = where,
               .actual = Quoted(header, 100),
               .allowed = "{'descr': '<f8', 'fortran_order': False, 'shape': (5001,)}",
               .cure = "save it again with numpy.savez"};
}

// The header is a Python dictionary; of its syntax what numpy writes is read, and nothing is evaluated.
class HeaderText {
 public:
  explicit HeaderText(std::string_view text) : rest_(text) {}

  bool Take(char wanted) {
    SkipBlanks();
    if (!rest_.starts_with(wanted)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  // 'text' or "text", without escapes.
  std::optional<std::string_view> Text() {
    SkipBlanks();
    if (rest_.empty() || (rest_[0] != '\'' && rest_[0] != '"')) return std::nullopt;
    const std::size_t end = rest_.find(rest_[0], 1);
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view text = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    return text;
  }
  std::optional<bool> Truth() {
    SkipBlanks();
    for (const auto& [word, value] : {std::pair{"True"sv, true}, std::pair{"False"sv, false}}) {
      if (!rest_.starts_with(word)) continue;
      rest_.remove_prefix(word.size());
      return value;
    }
    return std::nullopt;
  }
  // (), (5,) or (5, 2)
  std::optional<std::vector<std::size_t>> Shape() {
    std::vector<std::size_t> shape;
    if (!Take('(')) return std::nullopt;
    while (!Take(')')) {
      SkipBlanks();
      std::size_t axis = 0;
      const auto [end, failure] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), axis);
      if (failure != std::errc{} || shape.size() == kMostAxes) return std::nullopt;
      rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
      shape.push_back(axis);
      if (!Take(',') && !rest_.starts_with(')')) return std::nullopt;
    }
    return shape;
  }
  bool StartsList() {
    SkipBlanks();
    return rest_.starts_with('[');
  }

 private:
  void SkipBlanks() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \n"), rest_.size())); }
  std::string_view rest_;
};

// "<f8" -> kind and size.
Status ReadType(const std::string& where, std::string_view type, NpyArray* array) {
  const auto refuse = [&](const char* what, const char* cure) {
    return Error{.what = what,
                 .where = where,
                 .actual = Quoted(type),
                 .allowed = "booleans, integers, floats of 2, 4 or 8 bytes; little-endian",
                 .cure = cure};
  };
  std::size_t size = 0;
  const char* const end = type.data() + type.size();
  const bool sized = type.size() >= 3 && std::from_chars(type.data() + 2, end, size).ptr == end;
  const char kind = type.size() >= 2 ? type[1] : '?';
  if (kind == 'O') return refuse("an array of Python objects; nothing is unpickled", "save numbers: x.astype(float)");
  if (kind == 'M' || kind == 'm')
    return refuse("an array of dates", "save seconds: (t - t[0]) / np.timedelta64(1, 's')");
  if (kind == 'c') return refuse("an array of complex numbers", "save its parts: x.real, x.imag");
  if (type.starts_with('>')) return refuse("an array of big-endian numbers", "save x.astype(float)");
  const bool small = size == 1 || size == 2 || size == 4 || size == 8;
  if (kind == 'b' && size == 1)
    array->kind = NpyKind::kBool;
  else if (kind == 'i' && small)
    array->kind = NpyKind::kSigned;
  else if (kind == 'u' && small)
    array->kind = NpyKind::kUnsigned;
  else if (kind == 'f' && small && size > 1)
    array->kind = NpyKind::kFloat;
  else if (kind == 'U' && size <= 10'000)
    array->kind = NpyKind::kUnicode, size *= 4;
  else if (kind == 'S' && size <= 40'000)
    array->kind = NpyKind::kBytes;
  else
    return refuse("an array of a type that is no number", "save x.astype(float)");
  if (!sized || !(type.starts_with('<') || type.starts_with('|'))) return refuse("an unknown type of array", "");
  array->item_size = size;
  return Ok();
}

Status ReadHeader(const std::string& where, std::string_view text, NpyArray* array) {
  HeaderText header(text);
  bool typed = false, ordered = false, shaped = false;
  if (!header.Take('{')) return BrokenHeader(where, text);
  while (!header.Take('}')) {
    const auto key = header.Text();
    if (!key || !header.Take(':')) return BrokenHeader(where, text);
    if (*key == "descr") {
      if (header.StartsList())
        return Error{
            .what = "an array of records",
            .where = where,
            .actual = Quoted(text, 100),
            .allowed = "arrays of plain numbers",
            .cure = "save each field as an array of its own: np.savez(FILE, **{n: a[n] for n in a.dtype.names})"};
      const auto type = header.Text();
      if (!type) return BrokenHeader(where, text);
      GS_RETURN_IF_ERROR(ReadType(where, *type, array));
      typed = true;
    } else if (*key == "fortran_order") {
      const auto order = header.Truth();
      if (!order) return BrokenHeader(where, text);
      array->fortran_order = *order, ordered = true;
    } else if (*key == "shape") {
      const auto shape = header.Shape();
      if (!shape) return BrokenHeader(where, text);
      array->shape = *shape, shaped = true;
    } else {
      return BrokenHeader(where, text);
    }
    header.Take(',');
  }
  return typed && ordered && shaped ? Ok() : Status(BrokenHeader(where, text));
}

template <class T>
double Widened(const char* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

// IEEE 754 binary16.
double HalfAt(const char* at) {
  const auto bits = static_cast<unsigned>(Widened<std::uint16_t>(at));
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const double fraction = bits & 1023;
  const double size = exponent == 31  ? (fraction > 0 ? std::nan("") : HUGE_VAL)
                      : exponent == 0 ? std::ldexp(fraction, -24)
                                      : std::ldexp(1024 + fraction, exponent - 25);
  return bits >> 15 ? -size : size;
}

using ToDouble = double (*)(const char*);
ToDouble ConverterOf(NpyKind kind, std::size_t size) {
  switch (kind) {
    case NpyKind::kBool:
      return [](const char* at) { return *at ? 1.0 : 0.0; };
    case NpyKind::kSigned:
      return size == 1   ? Widened<std::int8_t>
             : size == 2 ? Widened<std::int16_t>
             : size == 4 ? Widened<std::int32_t>
                         : Widened<std::int64_t>;
    case NpyKind::kUnsigned:
      return size == 1   ? Widened<std::uint8_t>
             : size == 2 ? Widened<std::uint16_t>
             : size == 4 ? Widened<std::uint32_t>
                         : Widened<std::uint64_t>;
    case NpyKind::kFloat:
      return size == 2 ? HalfAt : size == 4 ? Widened<float> : Widened<double>;
    case NpyKind::kUnicode:
    case NpyKind::kBytes:
      break;
  }
  GS_CHECK(false && "an array of numbers");
  return nullptr;
}

// One character in UTF-8; what is no character becomes '?'.
void AppendUtf8(std::uint32_t c, std::string* text) {
  const auto tail = [&](int shift) { *text += static_cast<char>(0x80 | (c >> shift & 0x3F)); };
  if (c > 0x10FFFF || (c >= 0xD800 && c < 0xE000)) c = '?';
  if (c < 0x80) {
    *text += static_cast<char>(c);
  } else if (c < 0x800) {
    *text += static_cast<char>(0xC0 | c >> 6);
    tail(0);
  } else if (c < 0x10000) {
    *text += static_cast<char>(0xE0 | c >> 12);
    tail(6), tail(0);
  } else {
    *text += static_cast<char>(0xF0 | c >> 18);
    tail(12), tail(6), tail(0);
  }
}

}  // namespace

std::vector<double> NpyArray::Column(std::size_t column) const {
  GS_CHECK(shape.size() <= 2 && column < columns());
  const ToDouble convert = ConverterOf(kind, item_size);
  const std::size_t step = (fortran_order ? 1 : columns()) * item_size;
  const char* at = data.data() + (fortran_order ? column * rows() : column) * item_size;
  std::vector<double> values(rows());
  for (double& value : values) {
    value = convert(at);
    at += step;
  }
  return values;
}

std::vector<std::string> NpyArray::Texts() const {
  GS_CHECK(is_text());
  std::vector<std::string> texts;
  for (std::size_t at = 0; item_size > 0 && at + item_size <= data.size(); at += item_size) {
    const std::string_view item = data.substr(at, item_size);
    std::string text;
    if (kind == NpyKind::kBytes) {
      text = item.substr(0, std::min(item.find('\0'), item.size()));
    } else {
      for (std::size_t i = 0; i < item.size(); i += 4) {
        std::uint32_t c = 0;
        std::memcpy(&c, item.data() + i, sizeof c);
        if (c == 0) break;
        AppendUtf8(c, &text);
      }
    }
    texts.push_back(std::move(text));
  }
  return texts;
}

Result<NpyArray> ReadNpy(const std::string& where, std::string_view bytes) {
  if (bytes.size() < 10 || !bytes.starts_with(kMagic) || bytes[6] < 1 || bytes[6] > 3)
    return BrokenHeader(where, bytes.substr(0, 10));
  const std::size_t begin = bytes[6] == 1 ? 10 : 12;
  std::uint32_t length = 0;
  if (bytes.size() < begin) return BrokenHeader(where, bytes);
  std::memcpy(&length, bytes.data() + 8, begin - 8);
  if (length > bytes.size() - begin) return BrokenHeader(where, bytes.substr(begin));
  NpyArray array;
  GS_RETURN_IF_ERROR(ReadHeader(where, bytes.substr(begin, length), &array));
  array.data = bytes.substr(begin + length);
  std::size_t wanted = array.item_size;
  bool too_many = false;
  for (const std::size_t axis : array.shape) too_many |= __builtin_mul_overflow(wanted, axis, &wanted);
  if (too_many || wanted != array.data.size())
    return Error{.what = "an array whose data do not fill its shape",
                 .where = where,
                 .actual = fmt::format("{} bytes for ({}) elements of {}", array.data.size(),
                                       fmt::join(array.shape, ", "), array.item_size),
                 .allowed = "as many as the shape says",
                 .cure = "was the file cut off, or changed? Save it again"};
  return array;
}

}  // namespace gapscope
