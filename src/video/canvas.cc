#include "src/video/canvas.h"

#include <cmath>

#include "src/core/file.h"

namespace gapscope {
namespace {

cairo_surface_t* SurfaceOver(std::uint32_t* pixels, int width, int height) {
  return Cairo().cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(pixels), CAIRO_FORMAT_RGB24,
                                                     width, height, 4 * width);
}

}  // namespace

Canvas::Canvas(Picture& picture)
    : surface_(SurfaceOver(picture.pixels.data(), picture.width, picture.height)), cr(Cairo().cairo_create(surface_)) {
  Cairo().cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
}

Canvas::~Canvas() {
  Cairo().cairo_destroy(cr);
  Cairo().cairo_surface_destroy(surface_);
}

void Canvas::Ink(const Colour& colour, double alpha) {
  Cairo().cairo_set_source_rgba(cr, colour.r, colour.g, colour.b, alpha);
}

void Canvas::Font(double size, bool bold) {
  Cairo().cairo_select_font_face(cr, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                                 bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  Cairo().cairo_set_font_size(cr, size);
}

double Canvas::Width(const std::string& text) {
  cairo_text_extents_t extents;
  Cairo().cairo_text_extents(cr, text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::Text(const std::string& text, double x, double y, double anchor) {
  Cairo().cairo_move_to(cr, x - anchor * Width(text), y);
  Cairo().cairo_show_text(cr, text.c_str());
}

std::string Canvas::Fit(std::string text, double width) {
  if (Width(text) <= width) return text;
  while (!text.empty() && Width(text + "\u2026") > width) {
    do {
      text.pop_back();
    } while (!text.empty() && (text.back() & 0xC0) == 0x80);
  }
  return text + "\u2026";
}

void Canvas::Box(double x, double y, double w, double h, double radius) {
  Cairo().cairo_new_sub_path(cr);
  Cairo().cairo_arc(cr, x + w - radius, y + radius, radius, -M_PI / 2, 0);
  Cairo().cairo_arc(cr, x + w - radius, y + h - radius, radius, 0, M_PI / 2);
  Cairo().cairo_arc(cr, x + radius, y + h - radius, radius, M_PI / 2, M_PI);
  Cairo().cairo_arc(cr, x + radius, y + radius, radius, M_PI, 3 * M_PI / 2);
  Cairo().cairo_close_path(cr);
}

void Canvas::Card(double x, double y, double w, double h, double radius) {
  Box(x, y, w, h, radius);
  Ink(kPaper, 0.86);
  Cairo().cairo_fill(cr);
}

Status WritePng(const std::string& path, const Picture& picture) {
  std::string bytes;
  cairo_surface_t* surface =
      SurfaceOver(const_cast<std::uint32_t*>(picture.pixels.data()), picture.width, picture.height);
  const auto append = [](void* to, const unsigned char* data, unsigned int size) {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), size);
    return CAIRO_STATUS_SUCCESS;
  };
  const cairo_status_t status = Cairo().cairo_surface_write_to_png_stream(surface, append, &bytes);
  Cairo().cairo_surface_destroy(surface);
  if (status != CAIRO_STATUS_SUCCESS)
    return Error{.what = "cannot make the PNG", .where = path, .actual = Cairo().cairo_status_to_string(status)};
  return WriteFile(path, bytes);
}

}  // namespace gapscope
