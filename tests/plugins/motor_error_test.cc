// Wrong attributes: the compiler's error names the instance, the attribute, what is allowed and the cure; nothing
// aborts.
#include "tests/plugins/motor_testing.h"

namespace gapscope::testing {
namespace {

struct Wrong {
  Attributes config, live;
  std::string first;
  int actuators;
  std::vector<std::string> says;
};

class MotorErrorTest : public ::testing::TestWithParam<Wrong> {};

TEST_P(MotorErrorTest, CompileErrorExplains) {
  const Wrong& wrong = GetParam();
  const Rig rig{.config = wrong.config, .live = wrong.live, .first = wrong.first, .actuators = wrong.actuators};
  std::string message;
  LoadPlugins();
  const auto handler = mju_user_warning;
  mju_user_warning = nullptr;  // while compiling, the text is the error's
  const ModelPtr m = rig.TryCompile(&message);
  mju_user_warning = handler;
  EXPECT_FALSE(m);
  for (const std::string& part : wrong.says)
    EXPECT_NE(message.find(part), std::string::npos) << part << "\n" << message;
  EXPECT_NE(message.find("'motor'"), std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(
    All, MotorErrorTest,
    ::testing::Values(
        Wrong{{{"law", "servo"}}, {}, "", 1, {"'law'", "'servo'", "position, torque, current"}},
        Wrong{
            {{"law", "torque"}, {"inputs", "torque speed"}}, {}, "", 2, {"'inputs'", "feedforward", "remove 'speed'"}},
        Wrong{{{"law", "torque"}, {"inputs", "torque torque"}}, {}, "", 2, {"'inputs'", "at most once"}},
        Wrong{{{"law", "torque"}, {"inputs", "target"}}, {}, "", 1, {"'inputs'", "a list with 'torque'"}},
        Wrong{{{"law", "torque"}, {"inputs", "torque enable"}}, {}, "", 1, {"2 role(s)", "1 actuator(s)"}},
        Wrong{{{"law", "position"}}, {}, "", 1, {"'kp'", "missing", "add <config"}},
        Wrong{{{"law", "voltage"}, {"kt", "1"}, {"ke", "1"}}, {}, "", 1, {"'resistance'", "missing"}},
        Wrong{{{"law", "duty"}, {"duty_gain", "1"}, {"kt", "1"}, {"ke", "1"}, {"resistance", "1"}},
              {},
              "",
              1,
              {"'supply_v'", "missing"}},
        Wrong{{{"law", "position"}, {"kp", "1,5"}}, {}, "", 1, {"'kp'", "'1,5'", "a number N m/rad"}},
        Wrong{{{"law", "position"}, {"kp", "nan"}}, {}, "", 1, {"'kp'", "'nan'"}},
        Wrong{{{"law", "position"}, {"kp", "-1"}}, {}, "", 1, {"'kp'", "-1", "allowed 0"}},
        Wrong{{{"law", "torque"}}, {{"asymmetry", "2"}}, "", 1, {"'asymmetry'", "2.0", "allowed -1.0"}},
        Wrong{{{"law", "torque"}, {"dead_zone_on", "both"}}, {}, "", 1, {"'dead_zone_on'", "command, torque"}},
        Wrong{{{"law", "torque"}, {"command_delay_s", "0.14"}},
              {},
              "",
              1,
              {"'command_delay_s'", "0.14", "raise max_delay_s"}},
        Wrong{{{"law", "torque"}, {"max_delay_s", "1e9"}}, {}, "", 1, {"'max_delay_s'", "0 to 10"}},
        Wrong{{{"law", "torque"}, {"min_timestep_s", "0"}}, {}, "", 1, {"'min_timestep_s'", "1e-6 to 1"}},
        Wrong{{{"law", "torque"}, {"speed_table", "0 2 2"}, {"torque_table", "1 1 1"}},
              {},
              "",
              1,
              {"'speed_table'", "strictly ascending"}},
        Wrong{{{"law", "torque"}, {"speed_table", "0 2"}, {"torque_table", "1"}}, {}, "", 1, {"'torque_table'", "(2)"}},
        Wrong{{{"law", "torque"}, {"speed_table", "0 2"}}, {}, "", 1, {"'speed_table' stands alone"}},
        Wrong{{{"law", "torque"}, {"torque_table", "0 2"}}, {}, "", 1, {"'torque_table'", "(0)"}},
        Wrong{{{"law", "torque"}, {"speed_table", "0 2"}, {"torque_table", "2 1"}, {"table_interpolation", "spline"}},
              {},
              "",
              1,
              {"'table_interpolation'", "linear, cubic"}},
        Wrong{{{"law", "torque"}, {"time_constant_s", "0.1"}}, {}, "", 1, {"actdim 0", "actdim=\"1\""}},
        Wrong{{{"law", "torque"}, {"torque_limit_n_m", "1"}},
              {{"sag_fraction", "0"}, {"time_constant_s", "0"}},
              "actdim='1'",
              1,
              {"actdim 1", "actdim=\"2\""}},
        Wrong{{{"law", "torque"}, {"sag_fraction", "0.1"}}, {}, "actdim='1'", 1, {"'sag_fraction'", "ceiling"}},
        Wrong{{{"law", "torque"}}, {}, "dyntype='integrator'", 1, {"native dyntype", "time_constant_s"}},
        Wrong{{{"law", "torque"}}, {}, "delay='0.01' nsample='5'", 1, {"native delay", "command_delay_s"}}));

// After compiling, a number written out of range cannot be refused without ending the host: a warning and no torque.
TEST(MotorErrorTest, BadNumberInACompiledModelWarnsAndIsInert) {
  const Rig rig{.config = {{"law", "torque"}}, .live = {{"asymmetry", "0"}}};
  const ModelPtr m = rig.Compile();
  Live(m.get(), "asymmetry") = 7;
  static std::string warning;
  const auto handler = mju_user_warning;
  mju_user_warning = +[](const char* text) { warning = text; };
  const DataPtr d(mj_makeData(m.get()));
  mju_user_warning = handler;
  ASSERT_TRUE(d);
  EXPECT_NE(warning.find("'asymmetry'"), std::string::npos) << warning;
  EXPECT_NE(warning.find("without effect"), std::string::npos) << warning;
  d->ctrl[0] = 1;
  for (int k = 0; k < 10; ++k) mj_step(m.get(), d.get());
  EXPECT_EQ(d->qpos[0], 0);
}

}  // namespace
}  // namespace gapscope::testing
