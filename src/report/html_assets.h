// The files of src/report/html/, dygraphs and the glossary, as src/report/embed.cmake puts them into the library.
#ifndef GAPSCOPE_REPORT_HTML_ASSETS_H_
#define GAPSCOPE_REPORT_HTML_ASSETS_H_

namespace gapscope::assets {

extern const char* const kPage;
extern const char* const kStyle;
extern const char* const kScript;
extern const char* const kDygraphs;  // with its synchronizer; MIT licence
extern const char* const kDygraphsStyle;
extern const char* const kFleetPage;
extern const char* const kFleetStyle;  // beside kStyle
extern const char* const kFleetScript;
extern const char* const kGlossary;  // docs/reference/glossary.md

}  // namespace gapscope::assets

#endif  // GAPSCOPE_REPORT_HTML_ASSETS_H_
