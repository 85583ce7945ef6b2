// An experiment file, bound to a log, with the controller that it describes.
#include "src/experiment/experiment.h"

#include "replay/controller.h"
#include "tests/fuzz/bound_log.h"

FUZZ_TARGET(experiment) {
  using namespace gapscope;
  const std::string& path = fuzz::FileOf(fuzz::Text(data, size));
  const auto experiment = LoadExperiment(path);
  if (!experiment.ok()) {
    fuzz::CheckRefusal(experiment.error(), path + ":");
    return 0;
  }
  const auto recording = BindLog(experiment.value(), fuzz::BoundLog());
  const auto controller = LoadController(experiment.value());
  if (!controller.ok()) fuzz::CheckRefusal(controller.error(), path);
  if (!recording.ok()) return 0;
  if (controller.ok()) {
    auto made = Controller::Make(controller.value(), experiment.value(), recording.value());
    if (!made.ok()) return 0;
    made.value().Reset(Controller::Start::kSettled);
    const std::vector<double> readings(recording.value().measured.size(), 0.5);
    for (std::size_t row = 0; row < recording.value().rows(); ++row) made.value().Step(row, readings);
  }
  fuzz::whole = true;
  return 0;
}
