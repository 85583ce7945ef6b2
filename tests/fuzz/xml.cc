// An MJCF as `apply` changes it: its text, byte by byte.
#include "src/model/xml_text.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(xml) {
  using namespace gapscope;
  auto parsed = XmlText::Parse(std::string(fuzz::Text(data, size)), "robot.xml");
  if (!parsed.ok()) {
    fuzz::CheckRefusal(parsed.error(), "robot.xml");
    return 0;
  }
  XmlText& xml = parsed.value();
  const int last = static_cast<int>(xml.elements().size()) - 1;
  xml.SetAttribute(last, "name", "a\"&<'");
  xml.AddComment(0, "why -- so");
  xml.AddChild(0, XmlText::Place::kLast, {"<option/>"});
  const auto again = XmlText::Parse(xml.Edited(), "changed.xml");
  if (!again.ok()) fuzz::Complain("what was changed is no XML any more: " + again.error().Text());
  fuzz::whole = true;
  return 0;
}
