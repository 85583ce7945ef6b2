// What an effect's file includes. Every file NAME.cc in this folder defines `Effect Effect_NAME()`; CMake lists them in
// the catalogue.
#ifndef GAPSCOPE_MODEL_EFFECTS_CATALOGUE_H_
#define GAPSCOPE_MODEL_EFFECTS_CATALOGUE_H_

#include "src/model/effect.h"
#include "src/model/structure.h"

#endif  // GAPSCOPE_MODEL_EFFECTS_CATALOGUE_H_
