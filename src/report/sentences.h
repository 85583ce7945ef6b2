// What a diagnosis states, a sentence each: for console and page alike.
#ifndef GAPSCOPE_REPORT_SENTENCES_H_
#define GAPSCOPE_REPORT_SENTENCES_H_

#include <string>
#include <vector>

#include "src/diagnose/diagnosis.h"

namespace gapscope {

// A finding that is present: an effect, or a group of which the logs cannot tell which one it is.
struct Sentence {
  std::string what;         // "cable spring or gravity offset on arm"
  std::string size;         // of those that are in the final model, with their intervals; may be empty
  std::string caveat;       // "seen only beside command delay on motor"; may be empty
  std::string told_apart;   // "what would tell: tilt the rig", of a group; may be empty
  double share_of_gap = 0;  // of the gap that closes
  double probability = 0;
  std::string Text() const;  // "dry friction on elbow, 0.15 (0.13 .. 0.17) N m, 41 % of what closes, P 0.94"
};
// What a statement rests on; of what these logs cannot show, the input that would.
std::string WhyOf(const Statement& s);

// The largest share first.
std::vector<Sentence> SentencesOf(const Diagnosis& d);

// How the gap went on held-out logs. In free runs: empty where no effect was found or no free run was made.
std::string GapInWindows(const Diagnosis& d);
std::string GapInFreeRuns(const Diagnosis& d);
// What the next log may show: how far logs that are left out of the fit differ. Empty where there is one, or no effect
// was found.
std::string GapByLog(const Diagnosis& d);

// Whether what was found leaves more than the sensors' noise, so that it is worth to say where.
bool MuchRemains(const Diagnosis& d);

// Parts of the refitted base model's misfit, those that are known, in the order of a bar.
struct Part {
  std::string name;
  double share = 0;
};
std::vector<Part> PartsOf(const Remainder& remainder);

// What these logs leave open, and what the proposed experiment would tell of it, or a repeat of a log: a sentence each;
// empty: nothing is open.
std::vector<std::string> NextSentences(const Diagnosis& d);

// The size that an absent effect stays below (of a limit: above), "0.012 N m"; empty: no bound is known.
std::string BoundText(const Statement& statement);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_SENTENCES_H_
