#include "src/model/add_actuators.h"

#include <string>
#include <vector>

#include "src/core/names.h"

namespace gapscope {
namespace {

std::vector<std::string> NamesIn(mjSpec* spec, mjtObj type) {
  std::vector<std::string> names;
  for (mjsElement* e = mjs_firstElement(spec, type); e; e = mjs_nextElement(spec, e)) {
    if (const std::string name = mjs_getString(mjs_getName(e)); !name.empty()) names.push_back(name);
  }
  return names;
}

Status AddActuator(const AddedActuator& added, mjSpec* spec) {
  using enum AddedActuator::Kind;
  if (mjs_findElement(spec, mjOBJ_ACTUATOR, added.name.c_str())) {
    return Error{.what = "the MJCF has an actuator '" + added.name + "' already",
                 .where = added.where,
                 .cure = "rename the one under 'actuators:', or delete it there and set the MJCF's under 'set:'"};
  }
  mjsElement* element = mjs_findElement(spec, mjOBJ_JOINT, added.joint.c_str());
  if (!element) {
    return NoSuch("an actuator acts on a joint that the MJCF lacks", added.joint, NamesIn(spec, mjOBJ_JOINT),
                  added.where);
  }
  mjsJoint* joint = mjs_asJoint(element);
  if (joint->type != mjJNT_HINGE && joint->type != mjJNT_SLIDE) {
    return Error{.what = "the joint '" + added.joint + "' of an actuator is neither hinge nor slide",
                 .where = added.where,
                 .allowed = "hinge, slide"};
  }
  mjsActuator* actuator = mjs_addActuator(spec, nullptr);
  mjs_setName(actuator->element, added.name.c_str());
  mjs_setString(actuator->target, added.joint.c_str());
  actuator->trntype = mjTRN_JOINT;
  double kd[1] = {added.kd};
  if (added.kind == kPosition) {
    mjs_setToPosition(actuator, added.kp, kd, nullptr, nullptr, 0);
  } else if (added.kind == kVelocity) {
    mjs_setToVelocity(actuator, added.kd);
  } else {
    mjs_setToMotor(actuator);
  }
  if (added.force_limit) {
    actuator->forcelimited = mjLIMITED_TRUE;
    actuator->forcerange[0] = -*added.force_limit, actuator->forcerange[1] = *added.force_limit;
  }
  if (added.armature) joint->armature = *added.armature;
  return Ok();
}

// A body by its own name, or by that of its free joint.
mjsElement* FreeJointOf(mjSpec* spec, const std::string& name) {
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_JOINT); e; e = mjs_nextElement(spec, e)) {
    if (mjs_asJoint(e)->type != mjJNT_FREE) continue;
    const mjsBody* body = mjs_getParent(e);
    if (mjs_getString(mjs_getName(e)) == name || (body && mjs_getString(mjs_getName(body->element)) == name)) return e;
  }
  return nullptr;
}

Status Hold(mjSpec* spec, NamedBody& held) {
  mjsElement* joint = FreeJointOf(spec, held.name);
  if (joint) {
    mjsElement* body = mjs_getParent(joint)->element;
    if (*mjs_getString(mjs_getName(body)) == 0) mjs_setName(body, held.name.c_str());
    held.name = mjs_getString(mjs_getName(body));
    mjs_delete(spec, joint);
    return Ok();
  }
  if (mjs_findElement(spec, mjOBJ_BODY, held.name.c_str())) {
    return Error{.what = "the body '" + held.name + "' is held, but has no free joint",
                 .where = held.where,
                 .cure = "it stands still already or has other joints: delete it under 'hold:'"};
  }
  return NoSuch("a body is held that the MJCF lacks", held.name, NamesIn(spec, mjOBJ_BODY), held.where);
}

// The sensor of a body's or a site's pose in the world.
Status AddPoseSensor(const MeasuredSpec& measured, mjSpec* spec) {
  const bool of_body = !measured.body.empty();
  const std::string& name = of_body ? measured.body : measured.site;
  if (name.empty() || mjs_findElement(spec, mjOBJ_SENSOR, measured.on.c_str())) return Ok();
  const mjtObj type = of_body ? mjOBJ_BODY : mjOBJ_SITE;
  if (!mjs_findElement(spec, type, name.c_str())) {
    return NoSuch(std::string("a measured signal is of a ") + (of_body ? "body" : "site") + " that the MJCF lacks",
                  name, NamesIn(spec, type), measured.where);
  }
  mjsSensor* sensor = mjs_addSensor(spec);
  mjs_setName(sensor->element, measured.on.c_str());
  sensor->type = measured.kind == SignalKind::kOrientation ? mjSENS_FRAMEQUAT : mjSENS_FRAMEPOS;
  sensor->objtype = of_body ? mjOBJ_XBODY : mjOBJ_SITE;
  mjs_setString(sensor->objname, name.c_str());
  return Ok();
}

// Keyframes are of the model with its free joints.
void DeleteKeys(mjSpec* spec) {
  while (mjsElement* key = mjs_firstElement(spec, mjOBJ_KEY)) mjs_delete(spec, key);
}

}  // namespace

Status AddToSpec(Experiment* experiment, mjSpec* spec) {
  for (const AddedActuator& actuator : experiment->actuators) GS_RETURN_IF_ERROR(AddActuator(actuator, spec));
  for (NamedBody& held : experiment->hold) GS_RETURN_IF_ERROR(Hold(spec, held));
  if (!experiment->hold.empty()) DeleteKeys(spec);
  for (const MeasuredSpec& measured : experiment->measured) GS_RETURN_IF_ERROR(AddPoseSensor(measured, spec));
  for (const CommandSpec& command : experiment->commands) {
    if (mjs_findElement(spec, mjOBJ_ACTUATOR, command.actuator.c_str())) continue;
    return NoSuch("a command drives an actuator that the MJCF lacks", command.actuator, NamesIn(spec, mjOBJ_ACTUATOR),
                  command.where);
  }
  for (const Limit& limit : experiment->limits) {
    const mjtObj type = limit.joint.empty() ? mjOBJ_ACTUATOR : mjOBJ_JOINT;
    const std::string& name = limit.joint.empty() ? limit.actuator : limit.joint;
    if (mjs_findElement(spec, type, name.c_str())) continue;
    return NoSuch(
        std::string("a limit is of ") + (limit.joint.empty() ? "an actuator" : "a joint") + " that the MJCF lacks",
        name, NamesIn(spec, type), limit.where);
  }
  return Ok();
}

}  // namespace gapscope
