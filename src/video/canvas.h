// What pages are drawn on: a picture's pixels as cairo has them, lines of text, boxes.
#ifndef GAPSCOPE_VIDEO_CANVAS_H_
#define GAPSCOPE_VIDEO_CANVAS_H_

#include <string>

#include "replay/scene.h"
#include "src/video/cairo_library.h"

namespace gapscope {

struct Colour {
  double r, g, b;
};
inline constexpr Colour kPaper = {1, 1, 1};

// A cairo surface over a picture's pixels.
class Canvas {
 public:
  explicit Canvas(Picture& picture);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void Ink(const Colour& colour, double alpha = 1);
  void Font(double size, bool bold = false);
  double Width(const std::string& text);
  // Text whose anchor (0 left, 0.5 middle, 1 right) is at x, on the base line y.
  void Text(const std::string& text, double x, double y, double anchor = 0);
  // As much of the text as fits.
  std::string Fit(std::string text, double width);
  // A path with round corners.
  void Box(double x, double y, double w, double h, double radius);
  // Such a box of paper, through which the picture shows a little.
  void Card(double x, double y, double w, double h, double radius);

 private:
  cairo_surface_t* surface_;

 public:
  cairo_t* const cr;
};

// Writes a picture as PNG, to a temporary name first. Error: cannot write.
Status WritePng(const std::string& path, const Picture& picture);

}  // namespace gapscope

#endif  // GAPSCOPE_VIDEO_CANVAS_H_
