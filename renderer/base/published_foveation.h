// Choices of previews as Mrad 2022 published them, "Image Upscaling for Ray Traced Foveated Rendering"
// (preview/paper/paper_preview.h). What it got wrong is kept, and a switch each mends it.
#pragma once

namespace helio {

struct PublishedFoveation {
  // Radius of the disk that is sampled evenly, over the distance from the gaze to the farthest corner, [0.01, 1]: 0.15
  // where the paper measures times, 0.12443 where its own were shortest (section 5.2).
  double disk = 0.15;
  bool antialiasing = true;  // temporal, outside the disk (section 4.4)

  bool reject_history = false;  // of another surface
  bool fixed_disk = false;      // its radius over half of the diagonal, wherever the gaze is
  bool mean_rate = false;       // eq. 4.7 as the moving average that it is called
  bool surface_motion = false;  // eq. 4.6 of what a sample shows now, not of what it showed before

  bool operator==(const PublishedFoveation&) const = default;
};

}  // namespace helio
