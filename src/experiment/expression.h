// Arithmetic expressions of named numbers, as experiment files use them. The parser is muParser; names may hold dots.
#ifndef GAPSCOPE_EXPERIMENT_EXPRESSION_H_
#define GAPSCOPE_EXPERIMENT_EXPRESSION_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// One expression bound to an array of variables. Not thread-safe: one per worker.
class Expression {
 public:
  // `names[i]` reads `variables[i]`, which must outlive the expression and not move. `where` is for errors. Errors:
  // syntax, unknown name (with the nearest one), an assignment, several values, a number that is not finite.
  static Result<Expression> Parse(const std::string& text, const std::vector<std::string>& names, double* variables,
                                  const std::string& where);

  Expression(Expression&&) noexcept;
  Expression& operator=(Expression&&) noexcept;
  ~Expression();

  // The current value; NaN where it is undefined.
  double Evaluate() const;

 private:
  struct Impl;
  explicit Expression(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Whether the expression reads the variable of that name.
bool Mentions(const std::string& expression, const std::string& name);
// The expression with other names in the places of its own: `names` maps old to new.
std::string WithNames(const std::string& expression, const std::map<std::string, std::string>& names);
// The value of an expression of `values`. Errors as Parse, and a result that is not finite.
Result<double> EvaluateOnce(const std::string& text, const std::map<std::string, double>& values,
                            const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_EXPRESSION_H_
