#include "src/model/apply.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/model/mjcf_diff.h"
#include "src/model/same_model.h"

namespace gapscope {
namespace {

constexpr int kMostIncludes = 100;  // MuJoCo refuses a file that includes itself; this holds if it should not

using Origins = std::vector<ExportedModel::Origin>;
using Texts = std::vector<std::string>;

bool IsIn(const std::string& text, const Texts& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

// A spec as its own MJCF has it: its angles, its kinds of actuators, all digits.
Result<XmlText> InItsNotation(mjSpec& spec, const std::string& where) {
  spec.compiler.savecompiled = 0;
  spec.compiler.savecanonical = 0;
  GS_ASSIGN(std::string xml, SpecToXml(spec, where));
  return XmlText::Parse(std::move(xml), where);
}

// Without the actuators that the experiment adds: those are changes too.
Result<XmlText> AsItWas(const Rig& rig) {
  const std::string& where = rig.experiment().model_path;
  char message[1024] = "";
  const SpecPtr spec(mj_parseXML(where.c_str(), nullptr, message, sizeof message));
  if (!spec) return Error{.what = "cannot read the MJCF: " + OneLine(message), .where = where};
  const ModelPtr compiled(mj_compile(spec.get(), nullptr));
  if (!compiled)
    return Error{.what = "the MJCF does not compile: " + OneLine(mjs_getError(spec.get())), .where = where};
  return InItsNotation(*spec, where);
}

// The place of an include's or an asset's file. MuJoCo looks beside the main file first, then beside the including one.
std::string Resolve(const std::string& file, const std::string& main_folder, const std::string& own_folder) {
  const std::filesystem::path path(file), beside_main = main_folder / path;
  std::error_code failed;
  if (path.is_absolute() || std::filesystem::exists(beside_main, failed)) return beside_main.string();
  return (own_folder / path).string();
}

// As it is written in a file of `folder`.
std::string SeenFrom(const std::string& folder, const std::string& path) {
  return std::filesystem::proximate(std::filesystem::absolute(path), std::filesystem::absolute(folder)).string();
}

std::string FolderOf(const std::string& file) {
  const std::string folder = std::filesystem::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

// The user's text, in which elements are found by what they are called in the text before.
class UserText {
 public:
  UserText(XmlText xml, const XmlText& before) : xml_(std::move(xml)), before_(before) {}
  XmlText& xml() { return xml_; }

  // Index in the text; -1: none.
  int Find(int before) const {
    if (before == 0) return 0;
    const XmlElement& e = before_.at(before);
    const std::string section = SectionOf(before_, before), key = KeyOf(e);
    if (e.parent == 0) return FindSection(section);
    const auto& all = xml_.elements();
    if (key.empty()) {
      const int parent = Find(e.parent);
      if (parent < 0) return -1;
      for (const int child : all[parent].children) {
        if (all[child].tag == e.tag && KeyOf(all[child]).empty() &&
            OrdinalOf(xml_, child) == OrdinalOf(before_, before))
          return child;
      }
      return -1;
    }
    for (int i = 1; i < static_cast<int>(all.size()); ++i) {
      if (SectionOf(xml_, i) == section && IsCalled(xml_, i, e, section)) return i;
    }
    return -1;
  }
  // The last one, where there are several; -1: none.
  int FindSection(const std::string& tag) const {
    const auto& children = xml_.at(0).children;
    const auto found =
        std::find_if(children.rbegin(), children.rend(), [&](int child) { return xml_.at(child).tag == tag; });
    return found == children.rend() ? -1 : *found;
  }
  // Whether an element of any text is the one that `e` of a section is before.
  static bool IsCalled(const XmlText& xml, int element, const XmlElement& e, const std::string& section) {
    const XmlElement& other = xml.at(element);
    const bool of_kind =
        section == "actuator" ? other.parent >= 0 && xml.at(other.parent).tag == section : other.tag == e.tag;
    return of_kind && KeyOf(other) == KeyOf(e);
  }

 private:
  XmlText xml_;
  const XmlText& before_;
};

// Replaces the <include>s that hold what changes by what they hold.
class Includes {
 public:
  Includes(std::string main_path, const XmlText& before, const MjcfDiff& diff)
      : main_path_(std::move(main_path)), main_folder_(FolderOf(main_path_)), before_(before) {
    for (const auto& changed : diff.changed) needed_.push_back(changed.before);
    for (const auto& added : diff.added) needed_.push_back(added.parent_before);
  }

  Result<UserText> Run() {
    GS_ASSIGN(std::string text, ReadFile(main_path_));
    for (int round = 0; round < kMostIncludes; ++round) {
      GS_ASSIGN(XmlText xml, XmlText::Parse(std::move(text), main_path_));
      UserText user(std::move(xml), before_);
      const auto missing = std::find_if(needed_.begin(), needed_.end(),
                                        [&](int element) { return !IsSection(element) && user.Find(element) < 0; });
      if (missing == needed_.end()) return user;
      GS_ASSIGN(text, Spliced(user.xml(), Named(*missing)));
    }
    return Error{.what = "the MJCF's includes go too deep", .where = main_path_};
  }

 private:
  bool IsSection(int element) const { return before_.at(element).parent <= 0; }
  // The element itself, or the one with a name that it stands in.
  int Named(int element) const {
    while (KeyOf(before_.at(element)).empty() && !IsSection(before_.at(element).parent))
      element = before_.at(element).parent;
    return element;
  }

  Result<std::string> Spliced(XmlText& xml, int wanted) const {
    for (int i = 0; i < static_cast<int>(xml.elements().size()); ++i) {
      if (xml.at(i).tag != "include") continue;
      const std::string file = xml.at(i).Get("file"), path = Resolve(file, main_folder_, main_folder_);
      GS_ASSIGN(XmlText held, Read(path));
      GS_ASSIGN(const bool holds, Holds(held, path, wanted, 0));
      if (!holds) continue;
      const std::string inside = Inside(&held, path);
      xml.Replace(i, XmlComment("gapscope: in place of the include of " + file).append("\n").append(inside));
      return xml.Edited();
    }
    const XmlElement& e = before_.at(wanted);
    return Error{.what = "the MJCF's text has no " + e.tag + " '" + KeyOf(e) + "'",
                 .where = main_path_,
                 .allowed = "an element written out in it or in what it includes, not made by <replicate> or <attach>",
                 .cure = "write it out, or take the model.xml beside the result"};
  }

  static Result<XmlText> Read(const std::string& path) {
    GS_ASSIGN(std::string text, ReadFile(path));
    return XmlText::Parse(std::move(text), path);
  }

  Result<bool> Holds(const XmlText& xml, const std::string& path, int wanted, int depth) const {
    const XmlElement& e = before_.at(wanted);
    const std::string section = SectionOf(before_, wanted);
    for (int i = 0; i < static_cast<int>(xml.elements().size()); ++i) {
      if (UserText::IsCalled(xml, i, e, section)) return true;
      if (xml.at(i).tag != "include" || depth > kMostIncludes) continue;
      const std::string inner = Resolve(xml.at(i).Get("file"), main_folder_, FolderOf(path));
      GS_ASSIGN(const XmlText held, Read(inner));
      GS_ASSIGN(const bool holds, Holds(held, inner, wanted, depth + 1));
      if (holds) return true;
    }
    return false;
  }

  // What the root of an included file holds; its own includes as seen from the main file.
  std::string Inside(XmlText* held, const std::string& path) const {
    for (int i = 0; i < static_cast<int>(held->elements().size()); ++i) {
      if (held->at(i).tag != "include") continue;
      const std::string file = held->at(i).Get("file"), place = Resolve(file, main_folder_, FolderOf(path));
      if (std::filesystem::path(place) != std::filesystem::path(main_folder_) / file)
        held->SetAttribute(i, "file", SeenFrom(main_folder_, place));
    }
    const XmlText edited = XmlText::Parse(held->Edited(), path).value();
    const XmlElement& root = edited.at(0);
    const std::string inside = edited.text().substr(root.open_end, root.close - root.open_end);
    const std::size_t begin = inside.find_first_not_of("\r\n"), end = inside.find_last_not_of(" \t\r\n");
    return end == std::string::npos ? "" : inside.substr(begin, end + 1 - begin);
  }

  const std::string main_path_, main_folder_;
  const XmlText& before_;
  std::vector<int> needed_;
};

// What parameters make of an element, in the words of the notes.
class Notes {
 public:
  Notes(const Origins& origins, const std::map<std::string, std::string>& notes) : origins_(origins), notes_(notes) {}

  // Of an element's attributes (all of a new one, if none are named) and of what stands in it.
  Texts Of(const XmlText& xml, int element, const Texts& attributes) const {
    Texts found;
    Gather(xml, element, attributes, &found);
    return found;
  }

 private:
  // The attributes that a field is written as.
  static Texts AttributesOf(const std::string& kind, const std::string& field) {
    if (kind == "actuator") return {field, "gainprm", "biasprm", "kp", "kv", "dampratio", "instance"};
    // A body's own place, and what its <inertial> holds.
    if (kind == "body") return field == "pos" ? Texts{"pos"} : Texts{};
    if (kind == "inertial")
      return field == "mass"             ? Texts{"mass"}
             : field == "inertia"        ? Texts{"diaginertia"}
             : field == "ipos"           ? Texts{"pos"}
             : field == "pseudo_inertia" ? Texts{"mass", "pos", "quat", "diaginertia"}
                                         : Texts{};
    if (field == "damping_quadratic") return {"damping"};
    if (field == "stiffness_cubic") return {"stiffness"};
    if (field == "solref_limit") return {"solreflimit"};
    return {field};
  }

  void Add(const Origins::value_type& origin, Texts* found) const {
    for (const auto& parameter : origin.parameters) {
      const auto note = notes_.find(parameter);
      if (note != notes_.end() && !IsIn(note->second, *found)) found->push_back(note->second);
    }
  }
  // Fields of an element: of those of its attributes, or all.
  void AddFields(const std::string& kind, const std::string& name, const Texts& attributes, Texts* found) const {
    const std::string prefix = (kind == "inertial" ? "body" : kind) + "/" + name + "/";
    for (const auto& origin : origins_) {
      if (!origin.field.starts_with(prefix)) continue;
      const Texts written = AttributesOf(kind, origin.field.substr(prefix.size()));
      const bool touches =
          std::any_of(written.begin(), written.end(), [&](const auto& a) { return IsIn(a, attributes); });
      if (touches || (attributes.empty() && !written.empty())) Add(origin, found);
    }
  }
  // Fields that begin with `prefix`.
  void AddAll(const std::string& prefix, Texts* found) const {
    for (const auto& origin : origins_) {
      if (origin.field.starts_with(prefix)) Add(origin, found);
    }
  }

  void Gather(const XmlText& xml, int element, const Texts& attributes, Texts* found) const {
    const XmlElement& e = xml.at(element);
    const std::string section = SectionOf(xml, element);
    std::string name = KeyOf(e);
    if (e.tag == "inertial") name = xml.at(e.parent).Get("name");
    if (e.tag == "plugin" && e.Find("instance")) AddAll("numeric/" + e.Get("instance") + ".", found);
    if (e.tag == "option") AddAll("option/gravity", found);
    if (e.tag == "numeric" || e.tag == "text") {
      const std::string instance = name.substr(0, name.rfind('.'));
      AddAll("numeric/" + (e.tag == "text" ? instance + "." : name), found);
      AddAll("actuator/" + instance + "/", found);
    } else if (!name.empty()) {
      AddFields(section == "actuator" || section == "tendon" ? section : e.tag, name, attributes, found);
      AddAll("numeric/" + name + ".", found);
    }
    // An actuator that moves to the motor's side of a joint.
    if (section == "actuator" && IsIn("joint", attributes)) AddAll("joint/" + e.Get("joint") + "/", found);
    if (!attributes.empty()) return;
    for (const int child : e.children) Gather(xml, child, {}, found);
  }

  const Origins& origins_;
  const std::map<std::string, std::string>& notes_;
};

// Carries what differs into the user's text.
class Carrier {
 public:
  Carrier(UserText& user, const XmlText& before, const XmlText& after, const Notes& notes)
      : user_(user), before_(before), after_(after), notes_(notes) {}

  std::vector<AppliedChange> Run(const MjcfDiff& diff) {
    for (const auto& changed : diff.changed) Change(changed);
    for (const auto& added : diff.added) Add(added);
    return std::move(changes_);
  }

 private:
  std::string NameFor(const XmlText& xml, int element) const {
    const XmlElement& e = xml.at(element);
    const std::string key = KeyOf(e);
    if (!key.empty()) return e.tag + " " + key;
    return e.parent > 0 ? e.tag + " of " + NameFor(xml, e.parent) : e.tag;
  }

  // Notes that nothing else in the same parent has yet.
  Texts NewNotes(int user_parent, int after, const Texts& attributes) {
    Texts fresh, all = notes_.Of(after_, after, attributes);
    if (all.empty()) all = {"as the experiment file sets it"};
    for (const auto& note : all) {
      if (said_.emplace(user_parent, note).second) fresh.push_back("gapscope: " + note);
    }
    return fresh;
  }

  void Set(int element, int after, const std::string& attribute) {
    const std::string* old = user_.xml().at(element).Find(attribute);
    const std::string value = ShortValue(after_.at(after).Get(attribute));
    if (old && SameValue(*old, value)) return;
    user_.xml().SetAttribute(element, attribute, value);
    changes_.push_back({NameFor(after_, after), attribute, old ? *old : "", value});
  }
  void Remove(int element, int after, const std::string& attribute) {
    const std::string* old = user_.xml().at(element).Find(attribute);
    if (!old) return;
    user_.xml().RemoveAttribute(element, attribute);
    changes_.push_back({NameFor(after_, after), attribute, *old, ""});
  }

  void Change(const MjcfDiff::Changed& changed) {
    const int element = user_.Find(changed.before);
    if (element < 0) {  // an <option> that the text does not have
      Add({.parent_before = before_.at(changed.before).parent, .after = changed.after});
      return;
    }
    XmlText& xml = user_.xml();
    const XmlElement &mine = xml.at(element), &is = after_.at(changed.after);
    for (const auto& note : NewNotes(mine.parent, changed.after, changed.attributes)) xml.AddComment(element, note);
    // The writer may call it otherwise than the user, or write an inertia otherwise: then all of it is its.
    const bool other_kind = mine.tag != is.tag || (mine.Find("fullinertia") && is.Find("diaginertia"));
    Texts attributes = changed.attributes;
    if (other_kind) {
      if (mine.tag != is.tag) xml.Rename(element, is.tag);
      attributes = Collect(is.attributes, &XmlAttribute::name);
      for (const auto& attribute : mine.attributes) attributes.push_back(attribute.name);
    }
    std::set<std::string> done;
    for (const auto& attribute : attributes) {
      if (!done.insert(attribute).second) continue;
      is.Find(attribute) ? Set(element, changed.after, attribute) : Remove(element, changed.after, attribute);
    }
  }

  // An element's lines, with its notes above it and above those below it.
  Texts Lines(int after, int user_parent, bool with_notes) {
    const XmlElement& e = after_.at(after);
    Texts lines;
    if (with_notes) {
      for (const auto& note : NewNotes(user_parent, after, {})) lines.push_back(XmlComment(note));
    }
    std::string open = "<" + e.tag;
    for (const auto& attribute : e.attributes)
      open.append(" ").append(attribute.name).append("=\"").append(XmlEscape(ShortValue(attribute.value))).append("\"");
    lines.push_back(open + (e.children.empty() ? "/>" : ">"));
    for (const int child : e.children) {
      for (const auto& line : Lines(child, user_parent, false)) lines.push_back("  " + line);
    }
    if (!e.children.empty()) lines.push_back("</" + e.tag + ">");
    return lines;
  }

  void Add(const MjcfDiff::Added& added) {
    const XmlElement& e = after_.at(added.after);
    const bool section = e.parent == 0;
    const int parent = section ? user_.FindSection(e.tag) : user_.Find(added.parent_before);
    changes_.push_back({NameFor(after_, added.after), "", "", ""});
    if (section && parent < 0) {
      AddSection(added.after);
    } else if (section) {
      for (const int child : e.children)
        user_.xml().AddChild(parent, XmlText::Place::kLast, Lines(child, parent, true));
    } else if (parent < 0) {  // a section that the writer leaves out when it is empty, and so may the text
      user_.xml().AddChild(0, XmlText::Place::kLast, Wrapped(e.parent, Lines(added.after, 0, true)));
    } else {
      const bool first = e.tag == "inertial" || e.tag == "plugin";
      user_.xml().AddChild(
          parent,
          first && SectionOf(after_, added.after) == "worldbody" ? XmlText::Place::kFirst : XmlText::Place::kLast,
          Lines(added.after, parent, true));
    }
  }

  Texts Wrapped(int section, const Texts& lines) const {
    const std::string& tag = after_.at(section).tag;
    Texts wrapped = {"<" + tag + ">"};
    for (const auto& line : lines) wrapped.push_back("  " + line);
    wrapped.push_back("</" + tag + ">");
    return wrapped;
  }

  void AddSection(int section) {
    const XmlElement& e = after_.at(section);
    if (e.children.empty()) {  // <option gravity="..."/>: the rest of it is the writer's
      Texts lines;
      for (const auto& note : NewNotes(0, section, {})) lines.push_back(XmlComment(note));
      lines.push_back("<" + e.tag + " gravity=\"" + ShortValue(e.Get("gravity")) + "\"/>");
      user_.xml().AddChild(0, XmlText::Place::kLast, lines);
      return;
    }
    Texts lines;
    for (const int child : e.children) {
      for (const auto& line : Lines(child, -section - 1, true)) lines.push_back(line);
    }
    // Plugins are declared before they are used.
    const auto place = e.tag == "extension" ? XmlText::Place::kFirst : XmlText::Place::kLast;
    user_.xml().AddChild(0, place, Wrapped(section, lines));
  }

  UserText& user_;
  const XmlText &before_, &after_;
  const Notes& notes_;
  std::set<std::pair<int, std::string>> said_;  // by parent in the user's text
  std::vector<AppliedChange> changes_;
};

// Files that a text names, as seen from the folder it is for.
Result<std::string> WithPathsFor(const std::string& folder, const std::string& main_path, std::string text) {
  const std::string main_folder = FolderOf(main_path);
  std::error_code failed;
  if (std::filesystem::equivalent(folder, main_folder, failed)) return text;
  GS_ASSIGN(XmlText xml, XmlText::Parse(std::move(text), main_path));
  const Texts folders = {"meshdir", "texturedir", "assetdir"};
  const auto& all = xml.elements();
  const bool in_folders = std::any_of(all.begin(), all.end(), [&](const XmlElement& e) {
    return e.tag == "compiler" && std::any_of(folders.begin(), folders.end(), [&](const auto& f) { return e.Find(f); });
  });
  for (int i = 0; i < static_cast<int>(all.size()); ++i) {
    for (const auto& attribute : all[i].attributes) {
      const bool of_asset = SectionOf(xml, i) == "asset" && attribute.name.starts_with("file") && !in_folders;
      const bool of_compiler = all[i].tag == "compiler" && IsIn(attribute.name, folders);
      const bool of_include = all[i].tag == "include" && attribute.name == "file";
      if ((!of_asset && !of_compiler && !of_include) || std::filesystem::path(attribute.value).is_absolute()) continue;
      xml.SetAttribute(i, attribute.name,
                       SeenFrom(folder, (main_folder / std::filesystem::path(attribute.value)).string()));
    }
  }
  return xml.Edited();
}

// The text as MuJoCo reads it in that folder, beside the model it stands for.
Status Check(const std::string& text, const std::string& folder, const mjModel& wanted) {
  const auto wrong = [&](const std::string& what) {
    return Error{.what = what,
                 .where = folder,
                 .allowed = "a model that moves as the result's",
                 .cure = "write --out beside the MJCF itself, or take the model.xml beside the result"};
  };
  const std::string path = (std::filesystem::absolute(folder) / ".gapscope_apply.xml").string();
  mjVFS files;
  mj_defaultVFS(&files);
  const std::unique_ptr<mjVFS, decltype(&mj_deleteVFS)> owner(&files, mj_deleteVFS);
  mj_addBufferVFS(&files, path.c_str(), text.data(), static_cast<int>(text.size()));
  char message[1024] = "";
  const SpecPtr spec(mj_parseXML(path.c_str(), &files, message, sizeof message));
  if (!spec) return wrong("MuJoCo cannot read the changed MJCF: " + OneLine(message));
  ModelPtr compiled;
  try {
    compiled.reset(mj_compile(spec.get(), &files));
  } catch (const std::exception& e) {
    return wrong("MuJoCo refuses the changed MJCF: " + OneLine(e.what()));
  }
  if (!compiled) return wrong("the changed MJCF does not compile: " + OneLine(mjs_getError(spec.get())));
  const std::string difference = DifferenceOf(wanted, *compiled);
  if (!difference.empty()) return wrong("the changed MJCF would be another model: " + difference + " differs");
  return Ok();
}

}  // namespace

Result<AppliedMjcf> ApplyToMjcf(const Model& model, std::span<const double> values, const ApplyOptions& options) {
  const std::string& path = model.experiment().model_path;
  if (const auto& hold = model.experiment().hold; !hold.empty()) {
    return Error{.what = "the experiment holds '" + hold.front().name + "', which is free in the MJCF",
                 .where = hold.front().where,
                 .cure = "take the model.xml beside the result, which is the held robot"};
  }
  GS_ASSIGN(const XmlText before, AsItWas(*model.rig()));
  GS_ASSIGN(const ExportedModel exported, model.Export(values, nullptr, {}));
  GS_ASSIGN(const XmlText after, InItsNotation(*exported.spec, path));
  const MjcfDiff diff = DiffMjcf(before, after);
  GS_ASSIGN(UserText user, Includes(path, before, diff).Run());
  const Notes notes(exported.origins, options.notes);
  AppliedMjcf result;
  result.changes = Carrier(user, before, after, notes).Run(diff);
  const std::string folder = FolderOf(options.out);
  GS_ASSIGN(result.text, WithPathsFor(folder, path, user.xml().Edited()));
  GS_RETURN_IF_ERROR(Check(result.text, folder, *exported.compiled));
  result.left_out = exported.left_out;
  return result;
}

}  // namespace gapscope
