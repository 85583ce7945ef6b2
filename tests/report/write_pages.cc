// gapscope_report_pages FOLDER: the pages of pages.h as files, for browser_test.py.
#include <fmt/core.h>

#include <cstdio>

#include "src/core/file.h"
#include "src/report/fleet_report.h"
#include "tests/report/pages.h"

namespace gapscope {
namespace {

// 300 robots of ten days; of the third the friction doubles on the eighth, one of another's units failed.
std::string FleetHtml() {
  FleetPage page("diagnose", "experiment.yaml", "day");
  std::vector<std::string> days;
  for (int day = 0; day < 10; ++day) days.push_back(fmt::format("2026-03-{:02}", day + 1));
  for (int robot = 0; robot < 300; ++robot) {
    std::vector<UnitResult> units;
    for (int day = 0; day < 10; ++day) {
      const double friction = robot == 2 && day >= 7 ? 2 : 1, varied = 1 + 0.01 * ((7 * day + robot) % 5);
      UnitResult unit{.id = fmt::format("{}", day),
                      .time = days[static_cast<std::size_t>(day)],
                      .report = fmt::format("reports/{}/report.html", day),
                      .gap = robot == 5 ? 3 : varied,
                      .sizes = {{"friction", "N m", friction * varied, friction - 0.1, friction + 0.1}},
                      .statements = {{"backlash@arm", "present", 0.9}}};
      if (robot == 5 && day == 4) unit = {.id = "4", .time = unit.time, .state = "failed", .error = "no such column"};
      units.push_back(std::move(unit));
    }
    page.AddRobot(fmt::format("</script><b>robot {}", robot), units, ChangesOf(units));
  }
  return page.Html(days);
}

}  // namespace
}  // namespace gapscope

int main(int argc, char** argv) {
  using namespace gapscope;
  if (argc != 2) return 2;
  const std::string folder = argv[1];
  bool good = true;
  const auto write = [&](const std::string& name, const testing::Page& page) {
    good = good && WriteFile(folder + "/" + name + ".html", ReportHtml(page.result, page.source)).ok();
  };
  write("replay", *testing::ReplayPage());
  for (const Verdict verdict :
       {Verdict::kNone, Verdict::kParameters, Verdict::kEffects, Verdict::kAmbiguous, Verdict::kUnknown})
    write(VerdictName(verdict), *testing::DiagnosisPage(verdict));
  write("explained", *testing::ExplanationPage());
  write("many", *testing::ManyPage(29, 12000));
  good = good && WriteFile(folder + "/fleet.html", FleetHtml()).ok();
  write("long", *testing::LongPage(1000000, 654321));
  return good ? 0 : 1;
}
