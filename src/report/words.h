// A result in words. What a page says at its top, and what console and page both say of a result, is written here once;
// the page only draws it.
#ifndef GAPSCOPE_REPORT_WORDS_H_
#define GAPSCOPE_REPORT_WORDS_H_

#include <string>
#include <vector>

#include "src/core/statistics.h"
#include "src/report/diagnose_report.h"
#include "src/report/replay_report.h"
#include "src/report/tune_report.h"

namespace gapscope {

// Of an error over the motion's own spread: up to where the model follows closely, follows, is clearly off.
inline constexpr double kFollowsClosely = 0.05, kFollows = 0.2, kClearlyOff = 0.6;

// A stop on the error's way from the nominal model to the best one.
struct Stage {
  enum class Mark { kNone, kBest, kFloor };
  std::string name;  // "with cable spring on arm"
  double error = 0;  // normalised; finite
  Mark mark = Mark::kNone;
  std::string change;  // from the stage before: "−40 %, 80 % of what closes"; may be empty
};

struct Headline {
  std::string kind;                    // "Replay"
  std::string title;                   // the result in a sentence
  std::vector<std::string> sentences;  // the numbers that it rests on
  std::vector<Stage> stages;           // in order
  double confidence = kNaN;            // 0..1; NaN: it claims none
  std::string confidence_in = "Confidence in this verdict";
  std::string explanation;         // a paragraph; may be empty
  std::vector<std::string> notes;  // on the parameters, a line each
};
Headline HeadlineOf(const ReplayRun& run);
Headline HeadlineOf(const TuneRun& run);
Headline HeadlineOf(const DiagnoseRun& run);

// "cable spring on arm".
std::string Words(const EffectUse& use);
std::string Words(const Explanation& explanation);  // or "none"
// "a, b and c".
std::string Listed(const std::vector<std::string>& parts, const std::string& joiner = "and");
// Rounded to `digits` significant ones, without an exponent where people write none: 1230, 0.00004. "–": not finite.
std::string ShortNumber(double value, int digits);
// " N m", after a number; nothing for a share, whose unit is 1.
std::string UnitAfter(const std::string& unit);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_WORDS_H_
