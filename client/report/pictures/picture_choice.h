// Which pictures of a comparison the page shows, and how large.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "client/report/report_data.h"

namespace helio::report {

// Pixels of all pictures of a page together: at 8 bytes each, as text, some 20 MB.
inline constexpr std::uint64_t kPagePixels = 2'400'000;
inline constexpr std::size_t kMostViews = 6;

// The file of a view's reference, or of a mode's first seed and last budget: as the record names it, else by its usual
// name in pictures/. None: there is no such file, or it would lie outside of the folder.
std::optional<std::filesystem::path> reference_file(const ReportData& data, const std::filesystem::path& folder,
                                                    std::uint32_t view);
std::optional<std::filesystem::path> mode_file(const ReportData& data, const std::filesystem::path& folder,
                                               std::size_t mode, std::uint32_t view);

struct PictureChoice {
  std::vector<std::uint32_t> views;  // that are shown, rising
  std::size_t views_with_pictures = 0;
  int factor = 1;  // by which width and height are divided
};

// Spread evenly over the views that have pictures: as many as fit at full size, at least one; if that does not fit
// either, the smallest factor with which it does.
PictureChoice choose_pictures(const std::vector<std::uint32_t>& views, std::size_t pictures_a_view,
                              std::uint64_t pixels_a_picture);

}  // namespace helio::report
