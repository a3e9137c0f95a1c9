// The quantile of Student's t that the intervals of few values are made with.
#pragma once

namespace helio {

// Two-sided 95 % quantile of Student's t with `freedom` >= 1 degrees of freedom, relative error below 1e-6: the density
// integrated by Simpson's rule in the angle x = sqrt(freedom) tan a, where it is a power of the cosine, and bisected;
// of 200 degrees and more, Cornish and Fisher's expansion. Values are kept, so that a second call costs nothing.
double student_t_95(int freedom);

}  // namespace helio
