// gapscope_report_pages FOLDER: the pages of pages.h as files, for browser_test.py.
#include <cstdio>

#include "src/core/file.h"
#include "tests/report/pages.h"

int main(int argc, char** argv) {
  using namespace gapscope;
  if (argc != 2) return 2;
  const std::string folder = argv[1];
  bool good = true;
  for (const std::string kind : {"replay", "diagnosis"})
    good = good && WriteFile(folder + "/" + kind + ".html", ReportHtml(testing::DemoPage(kind)->source)).ok();
  good = good && WriteFile(folder + "/long.html", ReportHtml(testing::LongPage(1000000, 654321)->source)).ok();
  return good ? 0 : 1;
}
