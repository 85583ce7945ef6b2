// gapscope_report_pages FOLDER: the pages of pages.h as files, for browser_test.py.
#include <cstdio>

#include "src/core/file.h"
#include "tests/report/pages.h"

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
  write("long", *testing::LongPage(1000000, 654321));
  return good ? 0 : 1;
}
