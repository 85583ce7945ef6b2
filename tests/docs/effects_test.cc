// docs/reference/effects.md says what the catalogue says. Between its markers it is made from the catalogue:
// GAPSCOPE_WRITE_DOCS=1 build/tests/docs_effects_test rewrites it, without that the test compares.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdio>

#include "src/model/effect.h"
#include "tests/docs/made_part.h"

namespace gapscope {
namespace {

const char* PlaceText(EffectPlace place) {
  switch (place) {
    case EffectPlace::kMotor:
      return "an actuator on a joint";
    case EffectPlace::kServo:
      return "an actuator that feeds back the position";
    case EffectPlace::kJoint:
      return "a hinge or slide joint";
    case EffectPlace::kDrivenJoint:
      return "a joint with an actuator";
    case EffectPlace::kSpringJoint:
      return "a joint with a spring in the base model";
    case EffectPlace::kSignal:
      return "a measured signal";
    case EffectPlace::kBody:
      return "a body with a joint of its own";
    case EffectPlace::kModel:
      return "the model as a whole (`model`)";
    case EffectPlace::kNamed:
      break;
  }
  return "";
}

const char* ScaleText(ScaleKind kind) {
  switch (kind) {
    case ScaleKind::kOne:
      return "";
    case ScaleKind::kTorque:
      return "T";
    case ScaleKind::kAngle:
      return "A";
    case ScaleKind::kSpeed:
      return "W";
    case ScaleKind::kStiffness:
      return "T/A";
    case ScaleKind::kDrag:
      return "T/W^2";
    case ScaleKind::kPower:
      return "T W";
    case ScaleKind::kCommand:
      return "U";
    case ScaleKind::kMass:
      return "M";
    case ScaleKind::kLength:
      return "L";
    case ScaleKind::kCubic:
      return "T/A^3";
  }
  return "";
}

std::string Number(double value, ScaleKind kind) {
  char text[40];
  std::snprintf(text, sizeof text, "%g", value);
  return value == 0 || kind == ScaleKind::kOne ? text : std::string(text) + " " + ScaleText(kind);
}

std::string ReachOf(const EffectParameter& p) {
  char text[60] = "";
  if (p.reach_rad > 0) std::snprintf(text, sizeof text, ", on a hinge at least %g .. %g", -p.reach_rad, p.reach_rad);
  return text;
}

std::string EffectsText() {
  std::string text;
  for (const Effect& effect : Catalogue()) {
    std::string meaning = effect.meaning;
    meaning[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(meaning[0])));
    text += (text.empty() ? "## " : "\n## ") + effect.name + "\n\n";
    text += Wrapped(meaning + ". On " + PlaceText(effect.place) + ".") + "\n";
    text += "| parameter | unit | base | bounds |\n|---|---|---|---|\n";
    for (const EffectParameter& p : effect.parameters) {
      const std::string key = p.scale == ScaleKind::kCommand
                                  ? "`" + p.key + "_v`, `" + p.key + "_a` or `" + p.key + "_n_m`"
                                  : "`" + p.key + "`";
      const std::string unit = p.scale == ScaleKind::kCommand ? "V, A or N m" : p.unit;
      const std::string from = p.from_centre >= 0 ? "centre of mass + " : "";
      text += "| " + key + " | " + unit + " | " + from + Number(p.neutral, p.scale) + " | " + from +
              Number(p.low, p.scale) + " .. " + Number(p.high, p.scale) + ReachOf(p) + " |\n";
    }
    std::string told = "Shows as: " + effect.signature + ". Told apart by: " + effect.told_apart + ". Mistaken for: ";
    for (std::size_t i = 0; i < effect.partners.size(); ++i) told += (i ? ", " : "") + ("`" + effect.partners[i] + "`");
    text += "\n" + Wrapped(told + ".");
  }
  return text;
}

TEST(EffectsDocTest, IsWhatTheCatalogueSays) {
  ExpectMadePart("effects", "src/model/effects", EffectsText(), "docs_effects_test");
}

TEST(EffectsDocTest, PartnersAreEffects) {
  for (const Effect& effect : Catalogue()) {
    for (const auto& partner : effect.partners) {
      bool known = false;
      for (const Effect& other : Catalogue()) known = known || other.name == partner;
      EXPECT_TRUE(known) << effect.name << " names " << partner;
    }
  }
}

}  // namespace
}  // namespace gapscope
