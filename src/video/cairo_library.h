// cairo, opened when the first page is drawn. Linked, it would bring X11 and fonts into every command, and into the
// wheel, where only `render` has a use for them.
#ifndef GAPSCOPE_VIDEO_CAIRO_LIBRARY_H_
#define GAPSCOPE_VIDEO_CAIRO_LIBRARY_H_

#include <cairo/cairo.h>

#include "src/core/result.h"

// The functions that pages are drawn with.
#define GAPSCOPE_CAIRO_FUNCTIONS(X)      \
  X(cairo_arc)                           \
  X(cairo_clip)                          \
  X(cairo_close_path)                    \
  X(cairo_create)                        \
  X(cairo_destroy)                       \
  X(cairo_fill)                          \
  X(cairo_fill_preserve)                 \
  X(cairo_image_surface_create_for_data) \
  X(cairo_line_to)                       \
  X(cairo_move_to)                       \
  X(cairo_new_sub_path)                  \
  X(cairo_paint)                         \
  X(cairo_rectangle)                     \
  X(cairo_restore)                       \
  X(cairo_save)                          \
  X(cairo_select_font_face)              \
  X(cairo_set_font_size)                 \
  X(cairo_set_line_join)                 \
  X(cairo_set_line_width)                \
  X(cairo_set_source_rgba)               \
  X(cairo_show_text)                     \
  X(cairo_status_to_string)              \
  X(cairo_stroke)                        \
  X(cairo_surface_destroy)               \
  X(cairo_surface_write_to_png_stream)   \
  X(cairo_text_extents)

namespace gapscope {

struct CairoLibrary {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declared name takes none.
#define GAPSCOPE_MEMBER(name) decltype(&::name) name = nullptr;
  GAPSCOPE_CAIRO_FUNCTIONS(GAPSCOPE_MEMBER)
#undef GAPSCOPE_MEMBER
};

// Opens it once; safe from several threads. Error: it is not installed, or lacks a function.
Status OpenCairo();
// Opened before.
const CairoLibrary& Cairo();

}  // namespace gapscope

#endif  // GAPSCOPE_VIDEO_CAIRO_LIBRARY_H_
