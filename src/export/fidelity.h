// How well an exported MJCF moves: measured, on logs, beside the model that it stands for.
#ifndef GAPSCOPE_EXPORT_FIDELITY_H_
#define GAPSCOPE_EXPORT_FIDELITY_H_

#include <map>
#include <span>
#include <string>
#include <vector>

#include "src/core/statistics.h"
#include "src/core/thread_pool.h"
#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope {

// Normalised errors (ReplayError) in windows, nuisances fitted; how late the stamps are is the model's for all. NaN:
// not measured.
struct FidelityErrors {
  double nominal = kNaN, model = kNaN, exported = kNaN;
  // Share of what the model closes of the gap that the exported MJCF lets open again.
  double Lost() const;
};

// An exported file, and what is done beside it: effects by the host, late commands by the engine's configuration, and
// commands that whoever sends them changes.
struct ExportedFile {
  std::string path;  // empty: the rig's own model, with the effects of `host`
  std::vector<EffectUse> host;
  std::map<std::string, double> delays_s;         // by drive
  std::map<std::string, SentCommand> sent = {};   // by drive, what is sent for the log's commands
  std::map<std::string, DriveLaw> friction = {};  // by drive, what its law has of friction, by keys of gapscope.motor
};
// That of an exported model, at `path`; empty: as above.
ExportedFile FileOf(const ExportedModel& exported, const std::string& path);

// The file is read back as any program would, and driven by the experiment's commands. Errors: it does not load; a
// signal or a command of the experiment is not in it.
Result<FidelityErrors> MeasureFidelity(const Model& model, std::span<const double> values, const ExportedFile& file,
                                       const std::vector<Recording>& logs, ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_FIDELITY_H_
