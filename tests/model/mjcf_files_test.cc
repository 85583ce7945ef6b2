// The files that an MJCF takes in, wherever MuJoCo looks for them.
#include "src/model/mjcf_files.h"

#include <set>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

TEST(MjcfFilesTest, FindsIncludesAndAssetsOfEveryFolder) {
  const Scratch scratch;
  const std::string main = scratch.Write("rig/main.xml",
                                         "<mujoco><compiler meshdir='../meshes' texturedir='pictures'/>\n"
                                         "<include file='parts/arm.xml'/><!-- <include file='old.xml'/> -->\n"
                                         "<asset><mesh file='link.stl'/><texture file='floor.png'/>\n"
                                         "<texture type='cube' fileright='right.png' fileleft='left.png'/>\n"
                                         "<model name='hand' file='hand/hand.xml'/></asset></mujoco>");
  scratch.Write("rig/parts/arm.xml", "<mujoco><include file='parts/hook.xml'/><include file='beside.xml'/></mujoco>");
  scratch.Write("rig/hand/hand.xml", "<mujoco><asset><mesh file='finger.obj'/></asset></mujoco>");
  for (const char* name : {"rig/parts/hook.xml", "rig/parts/beside.xml", "rig/old.xml"})
    scratch.Write(name, "<mujoco/>");
  for (const char* name : {"meshes/link.stl", "meshes/other.stl", "rig/pictures/floor.png", "rig/pictures/right.png",
                           "rig/pictures/left.png", "rig/hand/finger.obj"})
    scratch.Write(name, "bytes");
  const auto found = FilesOfMjcf(main);
  ASSERT_TRUE(found.ok()) << found.error().Text();
  EXPECT_EQ(found.value().front(), main);
  std::set<std::string> names;
  for (const std::string& file : found.value())
    EXPECT_TRUE(names.insert(std::filesystem::path(file).lexically_normal().string()).second) << file;
  std::set<std::string> expected;
  for (const char* name : {"rig/main.xml", "rig/parts/arm.xml", "rig/parts/hook.xml", "rig/parts/beside.xml",
                           "rig/hand/hand.xml", "rig/hand/finger.obj", "meshes/link.stl", "rig/pictures/floor.png",
                           "rig/pictures/right.png", "rig/pictures/left.png"})
    expected.insert(scratch.Path(name));
  EXPECT_EQ(names, expected);
}

TEST(MjcfFilesTest, WhatIsNoXmlHasItsLine) {
  const Scratch scratch;
  const auto refused = FilesOfMjcf(scratch.Write("broken.xml", "<mujoco>\n<worldbody>\n</mujoco>"));
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().Text().find("broken.xml:"), std::string::npos) << refused.error().Text();
}

}  // namespace
}  // namespace gapscope::testing
