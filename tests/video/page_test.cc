// The page of a video in pixels: where the traces of few and of many signals stand.
#include "src/video/page.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope::testing {
namespace {

constexpr int kWidth = 640, kHeight = 360;

// `signals` of a minute, one row every 10 ms; the first one is predicted worst.
PageTraces Traces(int signals) {
  PageTraces traces;
  for (int r = 0; r <= 6000; ++r) traces.time_s.push_back(0.01 * r);
  for (int s = 0; s < signals; ++s) {
    PageTraces::Signal signal{.name = "joint", .unit = "rad", .moves = true, .measured = {}, .predicted = {{}}};
    for (const double t : traces.time_s) {
      signal.measured.push_back(std::sin(t));
      signal.predicted[0].push_back(std::sin(t) + 0.1 * (signals - s));
    }
    traces.signals.push_back(std::move(signal));
  }
  return traces;
}

Picture Composed(const Page& page, double time_s) {
  const Picture scene{.width = page.scene_width(),
                      .height = page.scene_height(),
                      .pixels = std::vector<std::uint32_t>(
                          static_cast<std::size_t>(page.scene_width()) * page.scene_height(), 0xff202020u)};
  Picture frame;
  page.Compose(std::vector<Picture>(page.panels(), scene), time_s, frame);
  return frame;
}

Page Made(int signals, std::size_t models = 1) {
  PageTraces traces = Traces(signals);
  for (auto& signal : traces.signals) signal.predicted.resize(models, signal.predicted[0]);
  return Page({.width = kWidth, .height = kHeight, .from_s = 0, .to_s = 60, .title = "log"}, std::move(traces),
              std::vector<PageModel>(models, {.label = "nominal", .error = 0.5}));
}

// Strokes in the first model's orange, in a part of the picture.
int Orange(const Picture& frame, int left, int right, int top, int bottom) {
  int count = 0;
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const std::uint32_t p = frame.pixels[static_cast<std::size_t>(y * frame.width + x)];
      count += (p >> 16 & 255) > 200 && (p & 255) < 90 ? 1 : 0;
    }
  }
  return count;
}

TEST(PageTest, FewSignalsStandBelowTheScene) {
  const Page page = Made(3);
  EXPECT_EQ(page.scene_width(), kWidth);
  EXPECT_LT(page.scene_height(), kHeight);
  EXPECT_GT(Orange(Composed(page, 30), 0, kWidth, page.scene_height(), kHeight), 100);
}

TEST(PageTest, ManySignalsStandBesideItAndRollPastTheCursor) {
  const Page page = Made(29);
  EXPECT_LT(page.scene_width(), kWidth);
  EXPECT_EQ(page.scene_height(), kHeight);
  const Picture early = Composed(page, 20), late = Composed(page, 40);
  // Eight plots of a height: each eighth of the column holds some of the past's full colour.
  for (int part = 0; part < 8; ++part) {
    EXPECT_GT(Orange(early, page.scene_width(), kWidth, 16 + part * kHeight / 9, 16 + (part + 1) * kHeight / 9), 10)
        << part;
  }
  // The past stands to the left of a cursor that stays in the middle: the picture has rolled, not the cursor.
  const int middle = page.scene_width() + (kWidth - page.scene_width() - 37 + 8) / 2;
  for (const Picture* frame : {&early, &late})
    EXPECT_GT(Orange(*frame, page.scene_width(), middle, 30, kHeight),
              3 * Orange(*frame, middle + 6, kWidth - 37 - 30, 30, kHeight));
  EXPECT_NE(early.pixels, late.pixels);
}

TEST(PageTest, SeveralModelsOfManySignalsHaveTheWorstBelowThem) {
  const Page page = Made(29, 4);
  EXPECT_EQ(page.scene_width(), kWidth / 4);
  EXPECT_LT(page.scene_height(), kHeight);
}

}  // namespace
}  // namespace gapscope::testing
