// What users of the shipped rigs rely on: names of joints and actuators, what a base model may hold, what can be
// rendered.
#include <gtest/gtest.h>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

TEST(RigContractTest, JointsAndMotorHaveTheContractsNames) {
  for (const auto& rig : RigNames()) {
    const ModelPtr m = LoadRig(rig);
    ASSERT_NE(m, nullptr);
    const auto& joints = FactsOfRig(rig).joints;
    ASSERT_EQ(m->njnt, static_cast<int>(joints.size())) << rig;
    for (int j = 0; j < m->njnt; ++j) EXPECT_EQ(mj_id2name(m.get(), mjOBJ_JOINT, j), joints[j]) << rig;
    const int motor = mj_name2id(m.get(), mjOBJ_ACTUATOR, FactsOfRig(rig).motor.c_str());
    ASSERT_GE(motor, 0) << rig;
    EXPECT_EQ(m->actuator_trnid[2 * motor], 0) << rig;
  }
}

TEST(RigContractTest, BaseModelsHoldNoEffects) {
  for (const auto& rig : RigNames()) {
    const ModelPtr m = LoadRig(rig);
    ASSERT_NE(m, nullptr);
    for (int i = 0; i < m->nv; ++i) {
      EXPECT_EQ(m->dof_frictionloss[i] > 0, FactsOfRig(rig).dry_friction) << rig;
    }
    for (int j = 0; j < m->njnt; ++j) {
      EXPECT_FALSE(m->jnt_limited[j]) << rig;
      EXPECT_EQ(m->jnt_stiffness[j] > 0, mj_id2name(m.get(), mjOBJ_JOINT, j) == FactsOfRig(rig).spring) << rig;
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
    const ModelPtr m = LoadRig(rig);
    ASSERT_NE(m, nullptr);
    for (const char* camera : {"fixed", "track", "top"})
      EXPECT_GE(mj_name2id(m.get(), mjOBJ_CAMERA, camera), 0) << rig << " " << camera;
    EXPECT_GE(m->ngeom, 10) << rig;
    for (int g = 0; g < m->ngeom; ++g)
      EXPECT_EQ(m->geom_contype[g] | m->geom_conaffinity[g], 0) << rig << " geom " << g;
    EXPECT_EQ(m->nlight, 2) << rig;
  }
}

}  // namespace
}  // namespace gapscope::testing
