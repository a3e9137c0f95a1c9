// Instruction sets by the names that --isa takes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace helio {

inline constexpr std::string_view kAutomaticIsa = "auto";

// From the oldest to the newest; empty for processors whose vector unit has but one set.
inline const std::vector<std::string>& instruction_sets() {
#if defined(__x86_64__)
  static const std::vector<std::string> all = {"sse2", "sse4.2", "avx", "avx2", "avx512"};
#else
  static const std::vector<std::string> all;
#endif
  return all;
}

// Embree's levels: avx2 includes FMA, BMI and LZCNT, avx512 includes F, BW, CD, DQ and VL.
inline bool processor_has([[maybe_unused]] std::string_view isa) {
#if defined(__x86_64__)
  if (isa == "sse2") return true;
  if (isa == "sse4.2") return __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  if (isa == "avx") return __builtin_cpu_supports("avx");
  if (isa == "avx2") {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
           __builtin_cpu_supports("bmi2");
  }
  if (isa == "avx512") {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
  }
#endif
  return false;
}

// Those of instruction_sets() that this machine's processor has.
inline std::vector<std::string> processor_instruction_sets() {
  std::vector<std::string> sets;
  for (const std::string& isa : instruction_sets()) {
    if (processor_has(isa)) sets.push_back(isa);
  }
  return sets;
}

// "" for kAutomaticIsa and for a set of this processor, else a clause that names the text and what is allowed.
inline std::string isa_problem(std::string_view text) {
  std::string allowed(kAutomaticIsa);
  bool known = false;
  for (const std::string& isa : instruction_sets()) known = known || isa == text;
  for (const std::string& isa : processor_instruction_sets()) {
    if (isa == text) return "";
    allowed.append(", ").append(isa);
  }
  if (text == kAutomaticIsa) return "";
  std::string problem("'");
  problem.append(text).append("'").append(known ? " is not in this processor" : "");
  return problem.append("; allowed: ").append(allowed);
}

}  // namespace helio
