// Errors as values. A bad file, flag or model gives an Error that says what is wrong, where, what was found, what is
// allowed and how to cure it; a broken contract inside the code throws std::logic_error through GS_CHECK.
#ifndef GAPSCOPE_CORE_RESULT_H_
#define GAPSCOPE_CORE_RESULT_H_

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace gapscope {

// One problem with an input. Only `what` is required.
struct Error {
  std::string what;     // "unknown key 'colum'"
  std::string where;    // "experiment.yaml:12:5" or "log.csv:7, column voltage_v"
  std::string actual;   // what was found
  std::string allowed;  // what would have been accepted
  std::string cure;     // what the user can do

  // "where: what: actual ..., allowed ...; cure", leaving out what is empty. One line.
  std::string Text() const;
};

// A value or the Error that prevented it.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : held_(std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : held_(std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return held_.index() == 0; }
  const T& value() const& {
    Check();
    return std::get<0>(held_);
  }
  T& value() & {
    Check();
    return std::get<0>(held_);
  }
  T&& value() && {
    Check();
    return std::get<0>(std::move(held_));
  }
  const Error& error() const { return std::get<1>(held_); }

 private:
  void Check() const {
    if (!ok()) throw std::logic_error("Result::value() without a value: " + std::get<1>(held_).Text());
  }
  std::variant<T, Error> held_;
};

using Status = Result<std::monostate>;
inline Status Ok() { return std::monostate{}; }

// Throws std::logic_error: a broken contract between parts of this program, always armed.
[[noreturn]] void ContractBroken(const char* condition, const char* file, int line);

}  // namespace gapscope

#define GS_CHECK(condition) ((condition) ? (void)0 : ::gapscope::ContractBroken(#condition, __FILE__, __LINE__))

// GS_ASSIGN(auto x, Expression()): returns the Error, or assigns the value.
#define GS_ASSIGN(target, expression) GS_ASSIGN_IMPL_(GS_CONCAT_(gs_result_, __LINE__), target, expression)
// NOLINTBEGIN(bugprone-macro-parentheses): names that are declared, and the target may declare one.
#define GS_ASSIGN_IMPL_(result, target, expression) \
  auto result = (expression);                       \
  if (!result.ok()) return result.error();          \
  target = std::move(result).value()
// NOLINTEND(bugprone-macro-parentheses)
// GS_RETURN_IF_ERROR(Expression()): returns the Error, if any.
#define GS_RETURN_IF_ERROR(expression)                                            \
  do {                                                                            \
    if (auto gs_status = (expression); !gs_status.ok()) return gs_status.error(); \
  } while (false)
#define GS_CONCAT_INNER_(a, b) a##b
#define GS_CONCAT_(a, b) GS_CONCAT_INNER_(a, b)

#endif  // GAPSCOPE_CORE_RESULT_H_
