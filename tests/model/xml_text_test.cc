// Changes in the text of an XML file leave every other byte as it is, however the file is written.
#include "src/model/xml_text.h"

#include <gtest/gtest.h>

namespace gapscope {
namespace {

XmlText Parsed(const std::string& text) {
  auto xml = XmlText::Parse(text, "robot.xml");
  EXPECT_TRUE(xml.ok()) << xml.error().Text();
  return std::move(xml).value();
}

int Named(const XmlText& xml, const std::string& name) {
  for (int i = 0; i < static_cast<int>(xml.elements().size()); ++i) {
    if (xml.at(i).Get("name") == name) return i;
  }
  ADD_FAILURE() << "no element " << name;
  return 0;
}

TEST(XmlTextTest, WhatIsNotChangedStays) {
  const std::string text =
      "\xef\xbb\xbf<?xml version=\"1.0\"?>\r\n<!DOCTYPE m>\n<!-- <a name=\"x\"> --> <m >\n\t<![CDATA[<b name='y'>]]>"
      "<a\n   name = 'x' k=\"1 &gt; &#48;&#x30;\"/ ></a>text</m><!-- end -->";
  EXPECT_FALSE(XmlText::Parse(text, "robot.xml").ok());  // "/ >" ends no tag
  std::string good = text;
  good.erase(good.find("/ >"), 2);
  const XmlText xml = Parsed(good);
  EXPECT_EQ(xml.Edited(), good);
  ASSERT_EQ(xml.elements().size(), 2u);
  EXPECT_EQ(xml.at(1).Get("k"), "1 > 00");
}

TEST(XmlTextTest, AnAttributeChangesInItsOwnQuotes) {
  XmlText xml = Parsed("<m><!-- name='j' --><j name='j'   a=\"1\"\n b='2' c=\"3\"/><j/></m>");
  const int joint = Named(xml, "j");
  xml.SetAttribute(joint, "a", "x\"<&'");
  xml.SetAttribute(joint, "b", "x'\"");
  xml.RemoveAttribute(joint, "c");
  xml.SetAttribute(joint, "d", "4");
  xml.SetAttribute(2, "e", "5");
  EXPECT_EQ(xml.Edited(),
            "<m><!-- name='j' --><j name='j'   a=\"x&quot;&lt;&amp;'\"\n b='x&apos;\"' d=\"4\"/><j e=\"5\"/></m>");
  EXPECT_EQ(Parsed(xml.Edited()).at(1).Get("a"), "x\"<&'");
}

TEST(XmlTextTest, ChildrenAndCommentsStandAsTheOthersDo) {
  XmlText xml = Parsed(
      "<m>\n    <w>\n        <b name=\"b\">\n            <j name=\"j\"/>\n        </b>\n    </w>\n    <c/>\n</m>");
  const int body = Named(xml, "b");
  xml.AddChild(body, XmlText::Place::kFirst, {"<first/>"});
  xml.AddChild(body, XmlText::Place::kLast, {"<last>", "  <in/>", "</last>"});
  xml.AddComment(Named(xml, "j"), "two -- dashes-");
  xml.AddChild(4, XmlText::Place::kLast, {"<n/>"});
  xml.Rename(body, "body");
  EXPECT_EQ(
      xml.Edited(),
      "<m>\n    <w>\n        <body name=\"b\">\n            <first/>\n            <!-- two - - dashes- -->\n"
      "            <j name=\"j\"/>\n            <last>\n              <in/>\n            </last>\n        </body>\n"
      "    </w>\n    <c>\n        <n/>\n    </c>\n</m>");
}

TEST(XmlTextTest, OneLineAndWindowsLineEnds) {
  XmlText line = Parsed("<m><b><j/></b></m>");
  line.AddComment(2, "c");
  line.AddChild(1, XmlText::Place::kLast, {"<k/>"});
  EXPECT_EQ(line.Edited(), "<m><b><!-- c --> <j/>\n  <k/>\n</b></m>");
  XmlText windows = Parsed("<m>\r\n <b>\r\n </b>\r\n</m>\r\n");
  windows.AddChild(1, XmlText::Place::kLast, {"<k/>"});
  EXPECT_EQ(windows.Edited(), "<m>\r\n <b>\r\n  <k/>\r\n </b>\r\n</m>\r\n");
  XmlText outdented = Parsed("  <m>\n<b>\n</b>\n  </m>");
  outdented.AddChild(1, XmlText::Place::kLast, {"<k/>"});
  EXPECT_EQ(outdented.Edited(), "  <m>\n<b>\n  <k/>\n</b>\n  </m>");
}

TEST(XmlTextTest, WhatIsNoXmlIsRefusedWithItsLine) {
  for (const auto& [text, says] : {std::pair{"", "robot.xml:1: no XML"},
                                   {"words", "no XML"},
                                   {"<m>\n<a>\n</m>", "robot.xml:3: a closing tag that nothing opened: got '</m>'"},
                                   {"<m>\n<a", "robot.xml:2: the tag 'a' does not end"},
                                   {"<m>\n", "the element 'm' is not closed"},
                                   {"<m/><n/>", "a second root element"},
                                   {"</m>", "nothing opened"},
                                   {"<m><!-- </m>", "the comment does not end"},
                                   {"<m><![CDATA[ </m>", "the CDATA section does not end"},
                                   {"<m a></m>", "an attribute of 'm' is not NAME=\"VALUE\""},
                                   {"<m a=1></m>", "an attribute of 'm'"},
                                   {"<m a=\"1></m>", "an attribute of 'm'"},
                                   {"<m>< a/></m>", "a '<' that begins no tag"},
                                   {"<m></m", "the closing tag 'm' does not end"}}) {
    const auto xml = XmlText::Parse(text, "robot.xml");
    ASSERT_FALSE(xml.ok()) << text;
    EXPECT_NE(xml.error().Text().find(says), std::string::npos) << xml.error().Text() << "\nlacks: " << says;
  }
}

}  // namespace
}  // namespace gapscope
