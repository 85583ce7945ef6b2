// What names of columns say, by a table written by hand.
#include "src/draft/column_name.h"

#include <gtest/gtest.h>

namespace gapscope {
namespace {

using Words = std::vector<std::string>;

TEST(ColumnNameTest, Words) {
  EXPECT_EQ(WordsOf("ArmAngle.deg"), (Words{"arm", "angle", "deg"}));
  EXPECT_EQ(WordsOf("q_des[3]"), (Words{"q", "des", "3"}));
  EXPECT_EQ(WordsOf("tau_con1"), (Words{"tau", "con", "1"}));
  EXPECT_EQ(WordsOf("/lowstate/motor_state[12]/q"), (Words{"lowstate", "motor", "state", "12", "q"}));
  EXPECT_EQ(WordsOf(""), Words{});
}

TEST(ColumnNameTest, SideAndQuantity) {
  struct Case {
    const char* name;
    Side side;
    Quantity quantity;
    const char* unit;
  };
  const Case cases[] = {
      {"tau_con1", Side::kCommand, Quantity::kTorque, ""},
      {"tau_meas2", Side::kMeasured, Quantity::kTorque, ""},
      {"q_des[3]", Side::kCommand, Quantity::kAngle, ""},
      {"pos_meas2", Side::kMeasured, Quantity::kAngle, ""},
      {"vel_meas1", Side::kMeasured, Quantity::kSpeed, ""},
      {"arm_deg", Side::kUnknown, Quantity::kAngle, "deg"},
      {"arm_vel_deg", Side::kUnknown, Quantity::kSpeed, "deg/s"},
      {"motor3.rpm", Side::kUnknown, Quantity::kSpeed, "rpm"},
      {"control/positions/Elbow", Side::kCommand, Quantity::kAngle, ""},
      {"positions/Elbow", Side::kUnknown, Quantity::kAngle, ""},
      {"action[4]", Side::kCommand, Quantity::kUnknown, ""},
      {"voltage_v", Side::kUnknown, Quantity::kElectric, "V"},
      {"current_a", Side::kUnknown, Quantity::kElectric, "A"},
      {"cmd_a", Side::kCommand, Quantity::kUnknown, ""},
      {"motor_temp1", Side::kUnknown, Quantity::kOther, ""},
      {"torque_n_m", Side::kUnknown, Quantity::kTorque, "N m"},
      {"xyz", Side::kUnknown, Quantity::kUnknown, ""},
  };
  for (const auto& [name, side, quantity, unit] : cases) {
    const ColumnName read = ReadNames({name}).front();
    EXPECT_EQ(read.side, side) << name;
    EXPECT_EQ(read.quantity, quantity) << name;
    EXPECT_EQ(read.unit, unit) << name;
  }
}

TEST(ColumnNameTest, TheNumberThatCountsIsTheOneThatChanges) {
  const auto read = ReadNames({"arm2_q1_f8", "arm2_q2_f8", "arm2_q3_f8", "time"});
  EXPECT_EQ(read[1].number, 2);
  EXPECT_EQ(read[2].number, 3);
  EXPECT_EQ(read[1].stem, "arm2_q#_f8");
  EXPECT_EQ(read[2].stem, read[1].stem);
  EXPECT_FALSE(read[3].number.has_value());
}

TEST(ColumnNameTest, FamiliesAndTheirLabels) {
  const auto read = ReadNames({"q/left hip", "q/knee", "q_des[0]", "q_des[1]"});
  EXPECT_EQ(FamilyOf(read[0]), FamilyOf(read[1]));
  EXPECT_NE(FamilyOf(read[0]), FamilyOf(read[2]));
  EXPECT_EQ(LabelOf("q/left hip", read[0]), "'q/*'");
  EXPECT_EQ(LabelOf("q_des[1]", read[3]), "'q_des[*]'");
}

TEST(ColumnNameTest, MatchesElements) {
  EXPECT_EQ(NameMatch("q/left_hip_pitch", "left_hip_pitch_joint"), 1);
  EXPECT_EQ(NameMatch("LeftHipPitch.pos", "left_hip_pitch_joint"), 1);
  EXPECT_EQ(NameMatch("joint1_pos", "joint1"), 1);
  EXPECT_EQ(NameMatch("FR_hip_q", "FR_hip_joint"), 1);
  EXPECT_LT(NameMatch("joint_pos[1]", "joint1"), 1) << "the number does not stand behind its word";
  EXPECT_LT(NameMatch("joint2_pos", "joint1"), 1);
  EXPECT_LT(NameMatch("q/left_hip_roll", "left_hip_pitch_joint"), 1);
  EXPECT_GT(NameMatch("q/left_hip_roll", "left_hip_pitch_joint"), 0);
  EXPECT_EQ(NameMatch("q/knee", "left_hip_pitch_joint"), 0);
  EXPECT_EQ(NameMatch("r_knee_q", "right_knee"), 1);
  EXPECT_LT(NameMatch("l_knee_q", "right_knee"), 1);
  EXPECT_GE(NameMatch("shoulderpan", "shoulder_pan"), 0.9);
}

}  // namespace
}  // namespace gapscope
