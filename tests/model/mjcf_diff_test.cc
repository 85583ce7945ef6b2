#include "src/model/mjcf_diff.h"

#include <gtest/gtest.h>

namespace gapscope {
namespace {

TEST(MjcfDiffTest, NumbersAreComparedAndWrittenToAMillionth) {
  EXPECT_TRUE(SameValue("0.1 2", "0.10000000001  2.0"));
  EXPECT_TRUE(SameValue("0", "1e-20"));
  EXPECT_FALSE(SameValue("0.1", "0.100001"));
  EXPECT_FALSE(SameValue("0.1", "0.1 0"));
  EXPECT_FALSE(SameValue("left", "right"));
  EXPECT_EQ(ShortValue("0.30000000000000004 5.7197916666666665e-05 -7"), "0.3 5.71979e-05 -7");
  EXPECT_EQ(ShortValue("1234570 1e-17 left"), "1.23457e+06 0 left");
}

TEST(MjcfDiffTest, FindsWhatIsNewAndWhatChanged) {
  const auto parse = [](const char* text) { return XmlText::Parse(text, "test").value(); };
  const XmlText before = parse(R"(<mujoco><option timestep="1"/><worldbody><body name="b"><inertial mass="1"/>
      <joint name="j" damping="1"/><joint name="k"/><geom size="1"/></body></worldbody>
      <actuator><position name="m" kp="2"/></actuator></mujoco>)");
  const XmlText after = parse(R"(<mujoco><option timestep="2"/><worldbody><body name="b"><inertial mass="2"/>
      <joint name="j" armature="1"/><geom size="1.0"/></body></worldbody>
      <actuator><plugin name="m"/></actuator><custom><numeric name="n"/></custom></mujoco>)");
  const MjcfDiff diff = DiffMjcf(before, after);
  ASSERT_EQ(diff.changed.size(), 3u);
  EXPECT_EQ(diff.changed[0].attributes, std::vector<std::string>{"mass"});
  EXPECT_EQ(diff.changed[1].attributes, (std::vector<std::string>{"armature", "damping"}));
  EXPECT_EQ(after.at(diff.changed[2].after).tag, "plugin");
  ASSERT_EQ(diff.added.size(), 1u);
  EXPECT_EQ(after.at(diff.added[0].after).tag, "custom");
}

}  // namespace
}  // namespace gapscope
