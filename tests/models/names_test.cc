// What users of the shipped rigs rely on: names of joints and actuators, what a base model may hold, what can be
// rendered.
#include <gtest/gtest.h>

#include <map>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

bool IsServo(const std::string& rig) { return rig == "xl330" || rig == "sts3032"; }

// The rig as shipped, or, without the motor plugin, with a native actuator in its place.
ModelPtr LoadAny(const std::string& rig) {
  return LoadRig(rig, IsServo(rig) && !HasMotorPlugin() ? "<motor name=\"motor\" joint=\"joint\"/>" : "");
}

const std::map<std::string, std::vector<std::string>>& JointNames() {
  static const std::map<std::string, std::vector<std::string>> names = {{"joint", {"joint"}},
                                                                        {"qube", {"arm", "pendulum"}},
                                                                        {"flexjoint", {"base", "link"}},
                                                                        {"flexlink", {"hub", "deflection"}},
                                                                        {"xl330", {"joint"}},
                                                                        {"sts3032", {"joint"}},
                                                                        {"ak80", {"joint"}},
                                                                        {"qube_simurlacra", {"arm", "pendulum"}},
                                                                        {"qube_koopman", {"arm", "pendulum"}},
                                                                        {"flexlink_2dsfl", {"hub", "deflection"}}};
  return names;
}

TEST(RigContractTest, JointsAndMotorHaveTheContractsNames) {
  for (const auto& rig : RigNames()) {
    const ModelPtr m = LoadAny(rig);
    ASSERT_NE(m, nullptr);
    const auto& joints = JointNames().at(rig);
    ASSERT_EQ(m->njnt, static_cast<int>(joints.size())) << rig;
    for (int j = 0; j < m->njnt; ++j) EXPECT_EQ(mj_id2name(m.get(), mjOBJ_JOINT, j), joints[j]) << rig;
    const int motor = mj_name2id(m.get(), mjOBJ_ACTUATOR, "motor");
    ASSERT_GE(motor, 0) << rig;
    // The motor drives the first joint.
    EXPECT_EQ(m->actuator_trnid[2 * motor], 0) << rig;
  }
}

TEST(RigContractTest, BaseModelsHoldNoEffects) {
  for (const auto& rig : RigNames()) {
    const ModelPtr m = LoadAny(rig);
    ASSERT_NE(m, nullptr);
    for (int i = 0; i < m->nv; ++i) {
      if (IsServo(rig)) {
        EXPECT_GT(m->dof_frictionloss[i], 0) << rig;
      } else {
        EXPECT_EQ(m->dof_frictionloss[i], 0) << rig;
      }
    }
    for (int j = 0; j < m->njnt; ++j) {
      EXPECT_FALSE(m->jnt_limited[j]) << rig;
      // Only the flexible rigs' second joint has a spring.
      EXPECT_EQ(m->jnt_stiffness[j] > 0, rig.starts_with("flex") && j == 1) << rig;
    }
    for (int a = 0; a < m->nu; ++a) {
      EXPECT_FALSE(m->actuator_forcelimited[a]) << rig;
      EXPECT_EQ(m->actuator_dyntype[a], mjDYN_NONE) << rig;
    }
    EXPECT_EQ(m->neq, 0) << rig;
    EXPECT_EQ(m->opt.integrator, mjINT_RK4) << rig;
    EXPECT_NE(m->opt.disableflags & mjDSBL_CONTACT, 0) << rig;
    EXPECT_NEAR(mju_norm3(m->opt.gravity), 9.81, 1e-12) << rig;
  }
}

TEST(RigContractTest, ThreeCamerasAndGeometryThatWeighsNothing) {
  for (const auto& rig : RigNames()) {
    const ModelPtr m = LoadAny(rig);
    ASSERT_NE(m, nullptr);
    for (const char* camera : {"fixed", "track", "top"})
      EXPECT_GE(mj_name2id(m.get(), mjOBJ_CAMERA, camera), 0) << rig << " " << camera;
    EXPECT_GE(m->ngeom, 10) << rig;
    if (IsServo(rig) && !HasMotorPlugin()) continue;  // loaded without the scene and its classes
    for (int g = 0; g < m->ngeom; ++g)
      EXPECT_EQ(m->geom_contype[g] | m->geom_conaffinity[g], 0) << rig << " geom " << g;
    EXPECT_EQ(m->nlight, 2) << rig;
  }
}

}  // namespace
}  // namespace gapscope::testing
