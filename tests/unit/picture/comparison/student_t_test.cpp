// Quantiles of Student's t.
#include "renderer/comparison/student_t.h"

#include <gtest/gtest.h>

#include <cmath>

namespace helio {
namespace {

TEST(ComparisonStudentT, HasTheTabulatedQuantiles) {
  // Two-sided 95 %, any table of the distribution; 1 and 2 degrees of freedom in closed form: tan(0.95 pi / 2) and
  // sqrt(2) 0.95 / sqrt(1 - 0.95^2).
  EXPECT_NEAR(student_t_95(1), std::tan(0.475 * M_PI), 1e-4);
  EXPECT_NEAR(student_t_95(2), std::sqrt(2.0) * 0.95 / std::sqrt(1 - 0.95 * 0.95), 1e-6);
  EXPECT_NEAR(student_t_95(4), 2.776445, 1e-5);
  EXPECT_NEAR(student_t_95(9), 2.262157, 1e-5);
  EXPECT_NEAR(student_t_95(30), 2.042272, 1e-5);
  EXPECT_NEAR(student_t_95(1000), 1.962339, 1e-5);
}

TEST(ComparisonStudentT, FallsAcrossTheStepToItsExpansion) {
  for (int freedom = 190; freedom < 210; ++freedom) {
    EXPECT_GT(student_t_95(freedom), student_t_95(freedom + 1)) << freedom;
    EXPECT_LT(student_t_95(freedom) - student_t_95(freedom + 1), 1e-4) << freedom;
  }
}

}  // namespace
}  // namespace helio
