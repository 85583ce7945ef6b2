// One array of an NPZ archive: the NPY format, versions 1 to 3, as numpy documents it in numpy.lib.format.
#ifndef GAPSCOPE_LOG_NPY_ARRAY_H_
#define GAPSCOPE_LOG_NPY_ARRAY_H_

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// What an element is. Numbers: booleans, integers of 1 to 8 bytes, floats of 2, 4 and 8 bytes.
enum class NpyKind { kBool, kSigned, kUnsigned, kFloat, kUnicode, kBytes };

struct NpyArray {
  NpyKind kind = NpyKind::kFloat;
  std::size_t item_size = 0;  // bytes
  bool fortran_order = false;
  std::vector<std::size_t> shape;  // empty: a single value
  std::string_view data;           // exactly the elements' bytes

  bool is_text() const { return kind == NpyKind::kUnicode || kind == NpyKind::kBytes; }
  std::size_t rows() const { return shape.empty() ? 1 : shape[0]; }
  std::size_t columns() const { return shape.size() < 2 ? 1 : shape[1]; }  // of an array of at most two axes
  // A column of a numeric array of at most two axes. Integers above 2^53 become the nearest double.
  std::vector<double> Column(std::size_t column) const;
  // The texts of an array of text, in C order, as UTF-8.
  std::vector<std::string> Texts() const;
};

// `where` names file and array. Errors: no NPY header or one that cannot be read; objects (which only unpickling would
// read), records, complex numbers, dates, big-endian numbers, floats of 16 bytes; a shape that the data do not fill.
Result<NpyArray> ReadNpy(const std::string& where, std::string_view bytes);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_NPY_ARRAY_H_
