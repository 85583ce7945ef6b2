#include "src/model/xml_text.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <tuple>

namespace gapscope {
namespace {

constexpr char kBlanks[] = " \t\r\n";
constexpr std::string_view kEndsName = " \t\r\n=/><\"'";

// A character by its number, in UTF-8.
std::string Utf8(unsigned long code) {
  std::string bytes;
  const auto tail = [&](int shift) { bytes += static_cast<char>(0x80 | ((code >> shift) & 0x3f)); };
  if (code < 0x80) {
    bytes += static_cast<char>(code);
  } else if (code < 0x800) {
    bytes += static_cast<char>(0xc0 | (code >> 6));
    tail(0);
  } else if (code < 0x10000) {
    bytes += static_cast<char>(0xe0 | (code >> 12));
    tail(6), tail(0);
  } else {
    bytes += static_cast<char>(0xf0 | ((code >> 18) & 0x07));
    tail(12), tail(6), tail(0);
  }
  return bytes;
}

// Entities become what they stand for; one that is unknown stays as it is.
std::string Decode(std::string_view raw) {
  constexpr std::pair<std::string_view, char> kNamed[] = {
      {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string text;
  for (std::size_t i = 0; i < raw.size();) {
    const std::string_view rest = raw.substr(i);
    const auto* named = std::find_if(std::begin(kNamed), std::end(kNamed),
                                     [&](const auto& entity) { return rest.starts_with(entity.first); });
    const std::size_t end = rest.starts_with("&#") ? rest.find(';') : std::string_view::npos;
    if (named != std::end(kNamed)) {
      text += named->second;
      i += named->first.size();
    } else if (end != std::string_view::npos && end < 10) {
      const bool hex = rest[2] == 'x';
      const std::string digits(rest.substr(hex ? 3 : 2, end - (hex ? 3 : 2)));
      text += Utf8(std::strtoul(digits.c_str(), nullptr, hex ? 16 : 10));
      i += end + 1;
    } else {
      text += raw[i++];
    }
  }
  return text;
}

// Reads the elements of a text, from its first byte to its last.
class Parser {
 public:
  Parser(const std::string& text, const std::string& where) : text_(text), where_(where) {}

  Result<std::vector<XmlElement>> Run() {
    while ((at_ = text_.find('<', at_)) != std::string::npos) GS_RETURN_IF_ERROR(Markup());
    if (!open_.empty())
      return Wrong("the element '" + elements_[open_.back()].tag + "' is not closed", elements_[open_.back()].begin);
    if (elements_.empty()) return Wrong("no XML: it has no element", 0);
    return std::move(elements_);
  }

 private:
  Error Wrong(const std::string& what, std::size_t at) const {
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(std::min(at, text_.size())), '\n');
    return Error{.what = what, .where = where_ + ":" + std::to_string(line)};
  }
  bool Sees(std::string_view word) const { return text_.compare(at_, word.size(), word) == 0; }

  // What begins with '<'.
  Status Markup() {
    for (const auto& [begin, end, name] :
         {std::tuple{"<!--", "-->", "comment"}, std::tuple{"<![CDATA[", "]]>", "CDATA section"},
          std::tuple{"<?", "?>", "declaration"}, std::tuple{"<!", ">", "declaration"}}) {
      if (!Sees(begin)) continue;
      const std::size_t found = text_.find(end, at_ + std::string_view(begin).size());
      if (found == std::string::npos) return Wrong("the " + std::string(name) + " does not end", at_);
      at_ = found + std::string_view(end).size();
      return Ok();
    }
    return Sees("</") ? Closing() : Opening();
  }

  std::string Name() {
    const std::size_t begin = at_;
    at_ = std::min(text_.find_first_of(kEndsName, at_), text_.size());
    return text_.substr(begin, at_ - begin);
  }
  void SkipBlanks() { at_ = std::min(text_.find_first_not_of(kBlanks, at_), text_.size()); }

  Status Closing() {
    const std::size_t begin = at_;
    at_ += 2;
    const std::string tag = Name();
    SkipBlanks();
    if (at_ == text_.size() || text_[at_] != '>') return Wrong("the closing tag '" + tag + "' does not end", begin);
    if (open_.empty() || elements_[open_.back()].tag != tag) {
      Error error = Wrong("a closing tag that nothing opened", begin);
      error.actual = "'</" + tag + ">'";
      if (!open_.empty()) error.allowed = "'</" + elements_[open_.back()].tag + ">'";
      return error;
    }
    XmlElement& element = elements_[open_.back()];
    element.close = begin;
    element.end = ++at_;
    open_.pop_back();
    return Ok();
  }

  Status Opening() {
    XmlElement element{.begin = at_++};
    element.tag = Name();
    if (element.tag.empty()) return Wrong("a '<' that begins no tag", element.begin);
    if (open_.empty() && !elements_.empty()) return Wrong("a second root element", element.begin);
    for (;;) {
      const std::size_t begin = at_;
      SkipBlanks();
      if (at_ == text_.size()) return Wrong("the tag '" + element.tag + "' does not end", element.begin);
      if (text_[at_] == '>' || Sees("/>")) break;
      GS_ASSIGN(XmlAttribute attribute, Attribute(begin, element.tag));
      element.attributes.push_back(std::move(attribute));
    }
    const bool closes = text_[at_] == '/';
    at_ += closes ? 2 : 1;
    element.open_end = element.close = element.end = at_;
    element.parent = open_.empty() ? -1 : open_.back();
    const int index = static_cast<int>(elements_.size());
    if (element.parent >= 0) elements_[element.parent].children.push_back(index);
    if (!closes) open_.push_back(index);
    elements_.push_back(std::move(element));
    return Ok();
  }

  Result<XmlAttribute> Attribute(std::size_t begin, const std::string& tag) {
    XmlAttribute attribute{.name = Name(), .begin = begin};
    SkipBlanks();
    const std::string what = "an attribute of '" + tag + "' is not NAME=\"VALUE\"";
    if (attribute.name.empty() || at_ == text_.size() || text_[at_] != '=') return Wrong(what, begin);
    ++at_;
    SkipBlanks();
    const char quote = at_ < text_.size() ? text_[at_] : ' ';
    if (quote != '"' && quote != '\'') return Wrong(what, begin);
    attribute.text_begin = at_ + 1;
    attribute.text_end = text_.find(quote, attribute.text_begin);
    if (attribute.text_end == std::string::npos) return Wrong(what, begin);
    attribute.value =
        Decode(std::string_view(text_).substr(attribute.text_begin, attribute.text_end - attribute.text_begin));
    at_ = attribute.text_end + 1;
    return attribute;
  }

  const std::string& text_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::vector<int> open_;
  std::vector<XmlElement> elements_;
};

std::string Escape(const std::string& value, char quote) {
  std::string text;
  for (const char c : value) {
    if (c == '&') {
      text += "&amp;";
    } else if (c == '<') {
      text += "&lt;";
    } else if (c == quote) {
      text += quote == '"' ? "&quot;" : "&apos;";
    } else {
      text += c;
    }
  }
  return text;
}

}  // namespace

const std::string* XmlElement::Find(const std::string& name) const {
  for (const auto& attribute : attributes) {
    if (attribute.name == name) return &attribute.value;
  }
  return nullptr;
}

std::string XmlElement::Get(const std::string& name) const {
  const std::string* value = Find(name);
  return value ? *value : "";
}

std::string XmlEscape(const std::string& value) { return Escape(value, '"'); }

std::string XmlComment(const std::string& text) {
  std::string inside;
  for (const char c : text) {
    // "--" may not stand in a comment, nor '-' at its end.
    if (c == '-' && inside.ends_with('-')) inside += ' ';
    inside += c;
  }
  return "<!-- " + inside + " -->";
}

Result<XmlText> XmlText::Parse(std::string text, const std::string& where) {
  XmlText xml;
  GS_ASSIGN(xml.elements_, Parser(text, where).Run());
  xml.text_ = std::move(text);
  const std::size_t line_end = xml.text_.find('\n');
  if (line_end != std::string::npos && line_end > 0 && xml.text_[line_end - 1] == '\r') xml.newline_ = "\r\n";
  return xml;
}

void XmlText::SetAttribute(int element, const std::string& name, const std::string& value) {
  const XmlElement& e = elements_[element];
  for (const auto& attribute : e.attributes) {
    if (attribute.name != name) continue;
    edits_.push_back({attribute.text_begin, attribute.text_end, Escape(value, text_[attribute.text_begin - 1])});
    return;
  }
  const std::size_t at = e.attributes.empty() ? e.begin + 1 + e.tag.size() : e.attributes.back().text_end + 1;
  edits_.push_back({at, at, " " + name + "=\"" + Escape(value, '"') + "\""});
}

void XmlText::RemoveAttribute(int element, const std::string& name) {
  for (const auto& attribute : elements_[element].attributes) {
    if (attribute.name == name) edits_.push_back({attribute.begin, attribute.text_end + 1, ""});
  }
}

void XmlText::Rename(int element, const std::string& tag) {
  const XmlElement& e = elements_[element];
  tags_[element] = tag;
  edits_.push_back({e.begin + 1, e.begin + 1 + e.tag.size(), tag});
  if (!e.ClosesItself()) edits_.push_back({e.close + 2, e.close + 2 + e.tag.size(), tag});
}

void XmlText::AddComment(int element, const std::string& comment) {
  const std::size_t at = elements_[element].begin;
  const std::string after = BeginsLine(at) ? newline_ + Indent(at) : " ";
  edits_.push_back({at, at, XmlComment(comment) + after});
}

void XmlText::AddChild(int parent, Place place, const std::vector<std::string>& lines) {
  added_[parent].emplace_back(place, lines);
}

void XmlText::Replace(int element, const std::string& text) {
  edits_.push_back({elements_[element].begin, elements_[element].end, text});
}

std::string XmlText::Indent(std::size_t at) const {
  const std::size_t before = at == 0 ? std::string::npos : text_.rfind('\n', at - 1);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  return text_.substr(begin, std::min(text_.find_first_not_of(" \t", begin), text_.size()) - begin);
}

bool XmlText::BeginsLine(std::size_t at) const {
  while (at > 0 && (text_[at - 1] == ' ' || text_[at - 1] == '\t')) --at;
  return at == 0 || text_[at - 1] == '\n';
}

std::string XmlText::IndentOfChildren(int parent) const {
  const auto of_own_line = [&](int element) -> const XmlElement* {
    for (const int child : elements_[element].children) {
      if (BeginsLine(elements_[child].begin)) return &elements_[child];
    }
    return nullptr;
  };
  if (const XmlElement* child = of_own_line(parent)) return Indent(child->begin);
  const XmlElement* section = of_own_line(0);
  const std::string root = Indent(elements_[0].begin), own = section ? Indent(section->begin) : "";
  const std::string step = own.starts_with(root) ? own.substr(root.size()) : "";
  return Indent(elements_[parent].begin) + (step.empty() ? "  " : step);
}

// Each line with its end.
std::string XmlText::Block(const std::string& indent, const std::vector<std::string>& lines) const {
  std::string text;
  for (const auto& line : lines) text.append(indent).append(line).append(newline_);
  return text;
}

void XmlText::PlaceChildren(int parent, std::vector<Edit>* edits) const {
  const XmlElement& e = elements_[parent];
  const std::string indent = IndentOfChildren(parent);
  std::string first, last;
  for (const auto& [place, lines] : added_.at(parent)) (place == Place::kFirst ? first : last) += Block(indent, lines);
  if (e.ClosesItself()) {
    const auto renamed = tags_.find(parent);
    const std::string close = "</" + (renamed == tags_.end() ? e.tag : renamed->second) + ">";
    edits->push_back({e.end - 2, e.end, ">" + newline_ + first + last + Indent(e.begin) + close});
    return;
  }
  if (!first.empty()) {
    // Behind the opening tag, whose line end follows or is made.
    const std::size_t next = std::min(text_.find_first_not_of(" \t\r", e.open_end), text_.size() - 1);
    const bool ends_line = text_[next] == '\n';
    const std::size_t at = ends_line ? next + 1 : e.open_end;
    edits->push_back({at, at, ends_line ? first : newline_ + first + indent});
  }
  if (!last.empty()) {
    const bool own_line = BeginsLine(e.close);
    const std::size_t at = own_line ? e.close - Indent(e.close).size() : e.close;
    edits->push_back({at, at, own_line ? last : newline_ + last + Indent(e.begin)});
  }
}

std::string XmlText::Edited() const {
  // New children first: a comment that is added at the same byte belongs to what follows them.
  std::vector<Edit> edits;
  for (const auto& [parent, added] : added_) PlaceChildren(parent, &edits);
  edits.insert(edits.end(), edits_.begin(), edits_.end());
  std::stable_sort(edits.begin(), edits.end(),
                   [](const Edit& a, const Edit& b) { return std::pair(a.begin, a.end) < std::pair(b.begin, b.end); });
  std::string text;
  std::size_t at = 0;
  for (const Edit& edit : edits) {
    GS_CHECK(edit.begin >= at && "two changes to the same text");
    text.append(text_, at, edit.begin - at).append(edit.text);
    at = edit.end;
  }
  return text.append(text_, at);
}

}  // namespace gapscope
