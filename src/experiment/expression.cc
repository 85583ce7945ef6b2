#include "src/experiment/expression.h"

#include <muParser.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>

#include "src/core/names.h"
#include "src/core/statistics.h"
#include "src/log/text.h"
#include "src/plugins/common/parser.h"

namespace gapscope {
namespace {

std::optional<double> AsNumber(const std::string& text) {
  double value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool IsOfName(char c) { return std::string_view(plugins::kNameChars).find(c) != std::string_view::npos; }

// The places of a whole name in an expression; each search goes on at `from`.
std::size_t FindName(const std::string& expression, const std::string& name, std::size_t from) {
  for (std::size_t at = expression.find(name, from); at != std::string::npos; at = expression.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || !IsOfName(expression[at - 1])) && (end == expression.size() || !IsOfName(expression[end])))
      return at;
  }
  return std::string::npos;
}

// How the parser reads a variable. The name of an effect's parameter holds that of a joint, in which any character may
// stand: it has an alias where needed. Other names that the parser cannot read (columns of a log) have none: they
// cannot be meant.
std::string NameInParser(const std::string& name, std::size_t index) {
  if (!name.empty() && std::ranges::all_of(name, IsOfName) && !std::isdigit(static_cast<unsigned char>(name.front())))
    return name;
  return name.find('@') == std::string::npos ? "" : "parameter@" + std::to_string(index);
}

std::string WithAliases(std::string text, const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string alias = NameInParser(names[i], i);
    if (alias.empty() || alias == names[i]) continue;
    for (std::size_t at = FindName(text, names[i], 0); at != std::string::npos;
         at = FindName(text, names[i], at + alias.size()))
      text.replace(at, names[i].size(), alias);
  }
  return text;
}

}  // namespace

// Most expressions are a number or one name: those need no parser.
struct Expression::Impl {
  double constant = 0;
  const double* variable = nullptr;
  std::unique_ptr<mu::Parser> parser;
};

Expression::Expression(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Expression::Expression(Expression&&) noexcept = default;
Expression& Expression::operator=(Expression&&) noexcept = default;
Expression::~Expression() = default;

Result<Expression> Expression::Parse(const std::string& text, const std::vector<std::string>& names, double* variables,
                                     const std::string& where) {
  auto impl = std::make_unique<Impl>();
  if (const auto number = AsNumber(text)) {
    if (!std::isfinite(*number))
      return Error{.what = "bad expression '" + text + "': not a finite number", .where = where};
    impl->constant = *number;
    return Expression(std::move(impl));
  }
  if (const auto found = std::find(names.begin(), names.end(), text); found != names.end()) {
    impl->variable = variables + (found - names.begin());
    return Expression(std::move(impl));
  }
  if (plugins::IsTooLong(text)) {
    return Error{.what = "the expression is too long",
                 .where = where,
                 .allowed = std::to_string(plugins::kLongestExpression) + " characters"};
  }
  if (plugins::Assigns(text)) {
    return Error{.what = "bad expression " + Quoted(text) + ": it assigns",
                 .where = where,
                 .cure = "compare with '==', or delete the '='"};
  }
  impl->parser = std::make_unique<mu::Parser>();
  try {
    plugins::SetText(impl->parser.get(), WithAliases(text, names));
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (const std::string name = NameInParser(names[i], i); !name.empty())
        impl->parser->DefineVar(name, variables + i);
    }
    impl->parser->Eval();
    if (impl->parser->GetNumResults() != 1)
      return Error{.what = "bad expression " + Quoted(text) + ": several values", .where = where, .allowed = "one"};
  } catch (const mu::Parser::exception_type& e) {
    const std::string message = Quoted(e.GetMsg(), 200);
    return Error{.what = "bad expression " + Quoted(text, 120) + ": " + message.substr(1, message.size() - 2),
                 .where = where,
                 .cure = e.GetCode() == mu::ecUNASSIGNABLE_TOKEN ? DidYouMean(e.GetToken(), names) : ""};
  }
  return Expression(std::move(impl));
}

double Expression::Evaluate() const {
  if (impl_->variable) return *impl_->variable;
  if (!impl_->parser) return impl_->constant;
  try {
    return impl_->parser->Eval();
  } catch (const mu::Parser::exception_type&) {
    return kNaN;
  }
}

bool Mentions(const std::string& expression, const std::string& name) {
  return FindName(expression, name, 0) != std::string::npos;
}

std::string WithNames(const std::string& expression, const std::map<std::string, std::string>& names) {
  std::string text;
  for (std::size_t at = 0; at < expression.size();) {
    std::size_t end = at;
    while (end < expression.size() && IsOfName(expression[end])) ++end;
    const std::string word = expression.substr(at, std::max<std::size_t>(1, end - at));
    const auto found = names.find(word);
    text += found == names.end() ? word : found->second;
    at += word.size();
  }
  return text;
}

Result<double> EvaluateOnce(const std::string& text, const std::map<std::string, double>& values,
                            const std::string& where) {
  std::vector<std::string> names;
  std::vector<double> numbers;
  for (const auto& [name, value] : values) {
    names.push_back(name);
    numbers.push_back(value);
  }
  GS_ASSIGN(const Expression expression, Expression::Parse(text, names, numbers.data(), where));
  const double value = expression.Evaluate();
  if (!std::isfinite(value)) return Error{.what = "the expression '" + text + "' is not finite", .where = where};
  return value;
}

}  // namespace gapscope
