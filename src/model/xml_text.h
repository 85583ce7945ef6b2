// XML as a person wrote it: where its elements and attributes stand, and changes that leave every other byte as it is.
// A library's tree would lose comments, blanks, quotes and the order of attributes, and with them a short `diff`.
#ifndef GAPSCOPE_MODEL_XML_TEXT_H_
#define GAPSCOPE_MODEL_XML_TEXT_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// Offsets are bytes of the text.
struct XmlAttribute {
  std::string name, value;     // the value without its quotes and entities
  std::size_t begin = 0;       // of the blanks before the name
  std::size_t text_begin = 0;  // after the opening quote
  std::size_t text_end = 0;    // of the closing quote
};

struct XmlElement {
  std::string tag;
  std::vector<XmlAttribute> attributes;
  std::vector<int> children;  // elements, in their order
  int parent = -1;            // -1: the root
  std::size_t begin = 0;      // of '<'
  std::size_t open_end = 0;   // after the '>' of the opening tag
  std::size_t close = 0;      // of the closing tag's '<'; `open_end` where there is none: <tag/>
  std::size_t end = 0;        // after the last '>'
  bool ClosesItself() const { return end == open_end; }
  // Null: it has no such attribute.
  const std::string* Find(const std::string& name) const;
  std::string Get(const std::string& name) const;  // "" where it has none
};

class XmlText {
 public:
  // Errors, with file and line: tags that do not match, an unfinished comment, tag or quote, no element or several
  // roots. `where` names the file.
  static Result<XmlText> Parse(std::string text, const std::string& where);

  const std::string& text() const { return text_; }
  const std::vector<XmlElement>& elements() const { return elements_; }  // parents first; [0] is the root
  const XmlElement& at(int element) const { return elements_[element]; }

  // Changes, each at most once to the same thing. Values are plain text: quotes and entities are seen to here.
  void SetAttribute(int element, const std::string& name, const std::string& value);
  void RemoveAttribute(int element, const std::string& name);  // one that it has
  void Rename(int element, const std::string& tag);
  // On a line of its own above the element, or beside it where it does not begin its line.
  void AddComment(int element, const std::string& comment);
  // `lines`: of the child, two blanks for each level below it.
  enum class Place { kFirst, kLast };
  void AddChild(int parent, Place place, const std::vector<std::string>& lines);
  // All of the element.
  void Replace(int element, const std::string& text);

  // The text with the changes.
  std::string Edited() const;

 private:
  struct Edit {
    std::size_t begin, end;  // the bytes that `text` stands for
    std::string text;
  };
  std::string Indent(std::size_t at) const;  // of the line
  bool BeginsLine(std::size_t at) const;
  std::string IndentOfChildren(int parent) const;
  std::string Block(const std::string& indent, const std::vector<std::string>& lines) const;
  void PlaceChildren(int parent, std::vector<Edit>* edits) const;

  std::string text_, newline_ = "\n";
  std::vector<XmlElement> elements_;
  std::vector<Edit> edits_;
  std::map<int, std::string> tags_;  // renamed
  std::map<int, std::vector<std::pair<Place, std::vector<std::string>>>> added_;
};

// As the value of an attribute in double quotes.
std::string XmlEscape(const std::string& value);
// "<!-- text -->", whatever the text holds.
std::string XmlComment(const std::string& text);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_XML_TEXT_H_
