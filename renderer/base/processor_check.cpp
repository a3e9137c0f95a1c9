// Ends a program with a sentence and exit code 1, not with an illegal instruction, where the processor lacks features
// that the program was compiled for.
//
// The check stands in .preinit_array, which the loader runs before every initialiser of the program and its libraries.
// It is compiled for the oldest processor. It calls no inline function of C++: the linker keeps one copy of those for
// the whole program, which may be one that was compiled for the new processor.
#include <string.h>
#include <unistd.h>

#include "renderer/base/processor_features.h"

namespace helio {

namespace {

struct Name {
  uint32_t feature;
  const char* text;
};

const Name kNames[] = {
    {kFeatureSse42, "sse4.2"},      {kFeaturePopcnt, "popcnt"},     {kFeatureMovbe, "movbe"},
    {kFeatureLzcnt, "lzcnt"},       {kFeatureBmi, "bmi"},           {kFeatureBmi2, "bmi2"},
    {kFeatureF16c, "f16c"},         {kFeatureFma, "fma"},           {kFeatureAvx, "avx"},
    {kFeatureAvx2, "avx2"},         {kFeatureAvx512f, "avx512f"},   {kFeatureAvx512bw, "avx512bw"},
    {kFeatureAvx512cd, "avx512cd"}, {kFeatureAvx512dq, "avx512dq"}, {kFeatureAvx512vl, "avx512vl"},
};

void put(const char* text) {
  if (write(STDERR_FILENO, text, strlen(text)) < 0) _exit(1);
}

void check_processor(int argc, char** argv, char**) {
  const uint32_t missing = kRequiredFeatures & ~present_features();
  if (missing == 0) return;
  const char* program = argc > 0 && argv[0] ? argv[0] : "heliograph";
  for (const char* c = program; *c; ++c) {
    if (*c == '/') program = c + 1;
  }
  put(program);
  put(": this processor lacks");
  for (const Name& name : kNames) {
    if (missing & name.feature) {
      put(" ");
      put(name.text);
    }
  }
  put(", which this build needs; a build from source on this machine runs (HELIO_ARCH=native)\n");
  _exit(1);
}

__attribute__((section(".preinit_array"), used)) void (*check_first)(int, char**, char**) = check_processor;

}  // namespace

}  // namespace helio
