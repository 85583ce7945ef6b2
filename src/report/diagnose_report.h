// A diagnosis for people and programs: console page, JSON (gapscope.diagnosis/1).
#ifndef GAPSCOPE_REPORT_DIAGNOSE_REPORT_H_
#define GAPSCOPE_REPORT_DIAGNOSE_REPORT_H_

#include <cstdint>
#include <string>

#include "src/diagnose/diagnosis.h"

namespace gapscope {

std::string DiagnosisTable(const Diagnosis& diagnosis);
std::string DiagnosisJson(const Diagnosis& diagnosis, std::uint64_t seed);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_DIAGNOSE_REPORT_H_
