// Parameter values become numbers of a compiled model: what a tuner changes between two runs.
#ifndef GAPSCOPE_MODEL_PARAMETER_WRITER_H_
#define GAPSCOPE_MODEL_PARAMETER_WRITER_H_

#include <map>
#include <span>
#include <string>
#include <vector>

#include "src/experiment/expression.h"
#include "src/model/model.h"

namespace gapscope {

// What expressions may name: parameters, then log values.
std::vector<std::string> VariableNames(const std::vector<Parameter>& parameters, const Experiment& experiment);

// Writes parameter values into one copy of a model. Not thread-safe: one per worker.
class ParameterWriter {
 public:
  // `target` must be a copy of model.compiled() and outlive the writer, as must `model`; `data` is scratch for MuJoCo's
  // derived constants.
  ParameterWriter(const Model& model, mjModel* target, mjData* data);
  ParameterWriter(const ParameterWriter&) = delete;
  ParameterWriter& operator=(const ParameterWriter&) = delete;

  // Writes all settings. Returns false, having written what it could, when an expression is not finite, a mass negative
  // or an inertia one that no mass has (IsInertia).
  bool Write(std::span<const double> values, const std::map<std::string, double>& log_values);

 private:
  // A joint split in a motor side and a load side (backlash, compliance).
  struct SplitJoint {
    int load_joint = -1, motor_joint = -1;
    Expression share;
  };
  struct Bound {
    std::vector<Expression> expressions;
    const Field* field;
  };
  void WriteSplits();

  const Model& model_;
  mjModel* target_;
  mjData* data_;
  std::vector<double> variables_;
  std::vector<std::string> log_names_;
  std::vector<Bound> bound_;
  std::vector<SplitJoint> splits_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_PARAMETER_WRITER_H_
