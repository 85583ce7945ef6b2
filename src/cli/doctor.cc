#include <dlfcn.h>
#include <fmt/core.h>
#include <mujoco/mujoco.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <zlib.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "replay/gl_context.h"
#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/session.h"
#include "src/core/apart.h"
#include "src/core/child.h"
#include "src/core/file.h"
#include "src/core/mujoco_handles.h"
#include "src/core/names.h"
#include "src/log/foreign.h"
#include "src/model/rig.h"
#include "src/report/json.h"
#include "src/report/version.h"
#include "src/video/cairo_library.h"
#include "src/video/encoder.h"

namespace gapscope::cli {
namespace {

// What a check came to. `cure`: of what is missing.
struct Health {
  bool good = true;
  std::string found, cure;
};

struct DoctorCheck {
  const char* name;
  const char* serves;  // what needs it
  bool needed;         // by replay, tune and diagnose: without it the exit status is 1
  Health (*look)(const std::string& folder);
};

// The file that a symbol of this process comes from.
std::string FileOf(const void* symbol) {
  Dl_info info{};
  return symbol && dladdr(symbol, &info) && info.dli_fname ? info.dli_fname : "an unknown file";
}

Health LookAtProgram(const std::string&) {
#ifdef __clang__
  constexpr const char* kCompiler = "";
#else
  constexpr const char* kCompiler = "GCC ";
#endif
  return {.found = fmt::format("gapscope {}, compiled by {}{}", GapscopeVersion(), kCompiler, __VERSION__)};
}

Health LookAtLibraries(const std::string&) {
  return {.found = fmt::format("Eigen {}.{}.{}, fmt {}.{}.{}, JSON {}.{}.{}, CLI11 {}, zlib {}", EIGEN_WORLD_VERSION,
                               EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, FMT_VERSION / 10000, FMT_VERSION / 100 % 100,
                               FMT_VERSION % 100, NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                               NLOHMANN_JSON_VERSION_PATCH, CLI11_VERSION, zlibVersion())};
}

Health LookAtMujoco(const std::string&) {
  const std::string file = FileOf(reinterpret_cast<const void*>(&mj_step));
  if (mj_version() == mjVERSION_HEADER) return {.found = fmt::format("{} ({})", MujocoVersion(), file)};
  return {
      .good = false,
      .found = fmt::format("{} is of version {}, the program was built for {}", file, mj_version(), mjVERSION_HEADER),
      .cure = "take that version out of LD_LIBRARY_PATH"};
}

Health LookAtPlugins(const std::string&) {
  std::string file, missing;
  int there = 0;
  constexpr std::array kNames = {"gapscope.motor", "gapscope.friction", "gapscope.spring", "gapscope.encoder",
                                 "gapscope.expression"};
  for (const char* name : kNames) {
    int slot = -1;
    const mjpPlugin* plugin = mjp_getPlugin(name, &slot);
    if (!plugin) missing += std::string(missing.empty() ? "" : ", ") + name;
    if (plugin) file = FileOf(reinterpret_cast<const void*>(plugin->nstate)), ++there;
  }
  if (missing.empty()) return {.found = fmt::format("{} of {} ({})", there, kNames.size(), file)};
  return {.good = false,
          .found = "not registered: " + missing,
          .cure = "libgapscope_plugins.so must be of this program's version: install the two together"};
}

// In a process of its own: what MuJoCo or a driver ends must not end this one. Empty: nothing is wrong.
std::string FaultOf(const std::function<std::string()>& work) {
  return TryApart([&] {
    mju_user_error = [](const char* message) { throw std::runtime_error(message); };
    return work();
  });
}

Health LookAtModel(const std::string&) {
  // As an effect would be added to a rig: a joint with a plugin on it, stepped.
  constexpr const char* kMjcf =
      "<mujoco><extension><plugin plugin='gapscope.friction'><instance name='f'><config key='joint' value='j'/>"
      "</instance></plugin></extension><worldbody><body><joint name='j' frictionloss='1e-9'/><geom size='0.1'/>"
      "<plugin plugin='gapscope.friction' instance='f'/></body></worldbody></mujoco>";
  const std::string fault = FaultOf([&]() -> std::string {
    char message[512] = "";
    const SpecPtr spec(mj_parseXMLString(kMjcf, nullptr, message, sizeof message));
    if (!spec) return message;
    const ModelPtr model(mj_compile(spec.get(), nullptr));
    if (!model) return mjs_getError(spec.get());
    const DataPtr data(mj_makeData(model.get()));
    for (int k = 0; k < 10; ++k) mj_step(model.get(), data.get());
    return "";
  });
  if (fault.empty()) return {.found = "a joint with a plugin compiles and steps"};
  return {.good = false, .found = fault, .cure = "install the program again; then please report this"};
}

// A context in which MuJoCo's renderer starts: apart, for a process opens one library only.
Health LookAtGl(GlBackend backend, const char* cure) {
  const std::string fault = FaultOf([&]() -> std::string {
    if (const auto opened = OpenGl(backend, 1, nullptr); !opened.ok()) return opened.error().actual;
    const auto context = GlContext::Make();
    if (!context.ok()) return context.error().what;
    const SpecPtr spec(mj_makeSpec());
    const ModelPtr model(mj_compile(spec.get(), nullptr));
    mjrContext drawing;
    mjr_defaultContext(&drawing);
    mjr_makeContext(model.get(), &drawing, mjFONTSCALE_100);
    mjr_freeContext(&drawing);
    return "";
  });
  if (fault.empty()) return {.found = "MuJoCo's renderer starts"};
  return {.good = false, .found = fault, .cure = cure};
}

Health LookAtOsmesa(const std::string&) {
  return LookAtGl(GlBackend::kOsmesa, "on Debian: apt-get install libosmesa6; or render with --gl egl");
}
Health LookAtEgl(const std::string&) {
  return LookAtGl(GlBackend::kEgl,
                  "on Debian: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri; or render with --gl osmesa");
}

Health LookAtCairo(const std::string&) {
  const Status opened = OpenCairo();
  if (opened.ok()) return {.found = "libcairo.so.2"};
  return {.good = false, .found = opened.error().actual, .cure = opened.error().cure};
}

Status WriteBlackVideo(const std::string& path, VideoFormat format) {
  constexpr int kSide = 64;
  const Picture black{.width = kSide, .height = kSide, .pixels = std::vector<std::uint32_t>(kSide * kSide)};
  GS_ASSIGN(const auto encoder, Encoder::Start(path, format, kSide, kSide, 10));
  for (int k = 0; k < 2; ++k) GS_RETURN_IF_ERROR(encoder->Write(black));
  return encoder->Finish();
}

Health LookAtEncoder(const std::string&) {
  const ScratchFolder scratch;
  Status written = WriteBlackVideo(scratch.Path("black.mp4"), VideoFormat::kMp4);
  if (written.ok()) written = WriteBlackVideo(scratch.Path("black.gif"), VideoFormat::kGif);
  if (written.ok()) return {.found = "ffmpeg writes MP4 (libx264) and GIF"};
  return {.good = false,
          .found = written.error().what + ": " + written.error().actual,
          .cure = "on Debian: apt-get install ffmpeg; a still (.png) needs none"};
}

Health LookAtRoom(const std::string& folder) {
  constexpr double kLeast = 100e6, kGiga = 1e9;  // a report with its tables is some tens of MB
  std::error_code failed;
  std::filesystem::path place = std::filesystem::absolute(folder, failed).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  // --out makes its folders.
  while (place.has_relative_path() && !std::filesystem::exists(place, failed)) place = place.parent_path();
  const auto probe = TemporaryBeside((place / "gapscope_doctor").string());
  if (!probe.ok())
    return {.good = false,
            .found = fmt::format("{} cannot be written: {}", place.string(), probe.error().actual),
            .cure = "another folder, or its owner's chmod u+w"};
  std::filesystem::remove(probe.value(), failed);
  struct statvfs disk{};
  if (statvfs(place.c_str(), &disk) != 0) return {.found = place.string() + " can be written; its room is not known"};
  const double room = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
  const std::string found = fmt::format("{} can be written, {:.1f} GB are free", place.string(), room / kGiga);
  if (room >= kLeast) return {.found = found};
  return {.good = false, .found = found, .cure = "make room for 0.1 GB at least, or choose another folder"};
}

Health LookAtTemporary(const std::string&) {
  std::error_code failed;
  const auto folder = std::filesystem::temp_directory_path(failed);
  if (!failed) return LookAtRoom(folder.string());
  return {.good = false, .found = failed.message(), .cure = "set TMPDIR to a folder that can be written"};
}

Health LookAtConverter(const std::string&) {
  const ScratchFolder scratch;
  const std::string converter = ConverterProgram(), said = scratch.Path("said");
  const int status = RunChild({converter, "--extras"}, said, ChildMessages::kDropped);
  if (status != 0)
    return {.good = false,
            .found = converter + (status < 0 ? fmt::format(": {}", std::strerror(-status))
                                             : fmt::format(" --extras ends with status {}", status)),
            .cure = kInstallConverter};
  const auto text = ReadFile(said);
  std::istringstream lines(text.ok() ? text.value() : "");
  std::string missing, extras;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || colon + 1 >= line.size()) continue;
    missing +=
        (missing.empty() ? "" : ";") + std::string(" ") + line.substr(0, colon) + " lacks" + line.substr(colon + 1);
    extras += (extras.empty() ? "" : ",") + line.substr(0, colon);
  }
  if (missing.empty()) return {.found = converter + ", with all extras"};
  const std::string torch = "torch";
  const bool lacks_torch = extras == torch || extras.ends_with("," + torch);
  if (lacks_torch) extras.resize(extras.size() - std::min(extras.size(), torch.size() + 1));
  std::string cure = extras.empty() ? "" : "pip install 'gapscope[" + extras + "]'";
  if (lacks_torch) cure += std::string(cure.empty() ? "" : "; for PACE recordings: ") + "pip install torch";
  return {.good = false, .found = converter + ";" + missing, .cure = cure};
}

Health LookAtProcessors(const std::string&) {
  const double bytes = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  return {.found = fmt::format("{} workers without --jobs, {:.1f} GB of memory", DefaultWorkers(), bytes / 1e9)};
}

// Every check: a new one is a row here.
constexpr DoctorCheck kChecks[] = {
    {"program", "everything", true, LookAtProgram},
    {"MuJoCo", "everything", true, LookAtMujoco},
    {"libraries", "everything", true, LookAtLibraries},
    {"plugins", "effects", true, LookAtPlugins},
    {"model", "effects", true, LookAtModel},
    {"machine", "everything", true, LookAtProcessors},
    {"folder", "--out", true, LookAtRoom},
    {"temporary", "render, formats of other tools", false, LookAtTemporary},
    {"OSMesa", "render", false, LookAtOsmesa},
    {"EGL", "render, where OSMesa is missing", false, LookAtEgl},
    {"cairo", "render", false, LookAtCairo},
    {"encoder", "render to .mp4 and .gif", false, LookAtEncoder},
    {"converter", "logs in formats of other tools", false, LookAtConverter},
};

struct DoctorFlags {
  CommonFlags common;
  std::string folder = ".";
};

void PrintHealth(const DoctorCheck& check, const Health& health) {
  const char* state = health.good ? "good" : check.needed ? "MISSING" : "missing";
  Print(stdout, "{:<11}{:<9}{}\n", check.name, state, health.found);
  if (!health.good) Print(stdout, "{:20}needed by: {}\n{:20}cure: {}\n", "", check.serves, "", health.cure);
}

Result<int> RunDoctor(const DoctorFlags& flags) {
  nlohmann::ordered_json checks = nlohmann::ordered_json::array();
  std::vector<std::string> lacking;
  for (const DoctorCheck& check : kChecks) {
    Health health = check.look(flags.folder);
    health.found = OneLine(std::move(health.found));
    checks.push_back({{"name", check.name},
                      {"good", health.good},
                      {"needed", check.needed},
                      {"serves", check.serves},
                      {"found", health.found},
                      {"cure", health.cure}});
    if (!health.good && check.needed) lacking.emplace_back(check.name);
    if (!flags.common.json) PrintHealth(check, health);
  }
  if (flags.common.json) {
    const nlohmann::ordered_json json = {
        {"schema", "gapscope.doctor/1"}, {"good", lacking.empty()}, {"checks", checks}, {"versions", JsonVersions()}};
    Print(stdout, "{}", JsonText(json));
  } else if (lacking.empty()) {
    Print(stdout, "\nAll that replay, tune and diagnose need is there.\n");
  } else {
    Print(stdout, "\nReplay, tune and diagnose lack: {}.\n", gapscope::Join(lacking));
  }
  return lacking.empty() ? kDone : kBelowThreshold;
}

}  // namespace

Command DoctorCommand() {
  auto flags = std::make_shared<DoctorFlags>();
  return {.name = "doctor",
          .what = "What of the program works on this machine, what is missing, and its cure",
          .options = Join({{{.flag = "--folder",
                             .value = &flags->folder,
                             .help = "Where results are to be written: its room, and whether it can be written",
                             .more = "A folder that is missing is not made: the one above it is looked at"}},
                           PrintOptions(flags->common)}),
          .example = "gapscope doctor --folder results",
          .run = [flags] { return RunDoctor(*flags); }};
}

}  // namespace gapscope::cli
