// What each column of a log may be: by its name, and where that says nothing by its data.
#ifndef GAPSCOPE_DRAFT_GUESS_COLUMNS_H_
#define GAPSCOPE_DRAFT_GUESS_COLUMNS_H_

#include <string>
#include <vector>

#include "src/draft/column_name.h"
#include "src/draft/samples.h"

namespace gapscope {

// A column with what its name and its data say.
struct Guess {
  int column = 0;  // of the log
  std::string name;
  ColumnName said;
  std::string file_unit;  // as the file states it
  bool is_time = false, used = false;
  bool leads = false;  // no name says that it is a command; another column follows it
};

// It says that it is of that quantity, or says of none.
bool MayBe(const Guess& guess, Quantity quantity);

// Indices of those that are not used yet, nor the time.
template <class Accept>
std::vector<int> Select(const std::vector<Guess>& guesses, const Accept& accept) {
  std::vector<int> chosen;
  for (int i = 0; i < static_cast<int>(guesses.size()); ++i) {
    if (!guesses[i].is_time && !guesses[i].used && accept(guesses[i])) chosen.push_back(i);
  }
  return chosen;
}

// What each column is. Columns that never move say nothing of an angle.
std::vector<Guess> GuessColumns(const Log& log, const Timeline& timeline, const Samples& samples);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_GUESS_COLUMNS_H_
