#include "src/fit/checkpoint.h"

namespace gapscope {

std::vector<double> Pack(const Checkpoint& s) {
  std::vector<double> record = {s.cost,
                                s.damping,
                                s.difference,
                                static_cast<double>(s.quiet),
                                static_cast<double>(s.iterations),
                                static_cast<double>(s.done),
                                static_cast<double>(s.termination),
                                static_cast<double>(s.work.evaluations),
                                static_cast<double>(s.work.replays),
                                static_cast<double>(s.work.steps)};
  record.insert(record.end(), s.point.y.begin(), s.point.y.end());
  for (const auto& state : s.point.states) record.insert(record.end(), state.begin(), state.end());
  return record;
}

void Unpack(const std::vector<double>& record, Checkpoint* s) {
  s->cost = record[0], s->damping = record[1], s->difference = record[2];
  s->quiet = static_cast<int>(record[3]), s->iterations = static_cast<int>(record[4]), s->done = record[5] != 0;
  s->termination = static_cast<Termination>(static_cast<int>(record[6]));
  s->work = {.evaluations = static_cast<std::size_t>(record[7]),
             .replays = static_cast<std::size_t>(record[8]),
             .steps = static_cast<std::size_t>(record[9])};
  std::size_t at = 10;
  for (double& y : s->point.y) y = record[at++];
  for (auto& state : s->point.states) {
    for (double& x : state) x = record[at++];
  }
}

}  // namespace gapscope
