#include "client/report/pictures/picture_choice.h"

#include <algorithm>
#include <string>

namespace helio::report {
namespace {

namespace fs = std::filesystem;

// The record may come from anywhere: a name of it must not lead out of its folder.
std::optional<fs::path> inside(const fs::path& folder, const fs::path& name) {
  const fs::path relative = name.lexically_normal();
  if (relative.empty() || relative.has_root_path() || *relative.begin() == "..") return std::nullopt;
  std::error_code ignored;
  const fs::path file = folder / relative;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  return file;
}

}  // namespace

std::optional<fs::path> reference_file(const ReportData& data, const fs::path& folder, std::uint32_t view) {
  for (const pb::CompareRecord::Picture& picture : data.record().pictures()) {
    if (picture.reference() && picture.view() == view) return inside(folder, picture.file());
  }
  return inside(folder, fs::path("pictures") / ("reference.view" + std::to_string(view) + ".exr"));
}

std::optional<fs::path> mode_file(const ReportData& data, const fs::path& folder, std::size_t mode,
                                  std::uint32_t view) {
  const std::string& name = data.mode_name(mode);
  const pb::CompareRecord::Picture* best = nullptr;
  for (const pb::CompareRecord::Picture& picture : data.record().pictures()) {
    if (picture.reference() || picture.mode() != name || picture.view() != view) continue;
    const bool later = !best || picture.budget() > best->budget() ||
                       (picture.budget() == best->budget() && picture.seed_number() < best->seed_number());
    if (later) best = &picture;
  }
  if (best) return inside(folder, best->file());
  return inside(folder, fs::path("pictures") / (name + ".view" + std::to_string(view) + ".exr"));
}

PictureChoice choose_pictures(const std::vector<std::uint32_t>& views, std::size_t pictures_a_view,
                              std::uint64_t pixels_a_picture) {
  PictureChoice choice;
  choice.views_with_pictures = views.size();
  if (views.empty()) return choice;
  const std::uint64_t a_view = std::max<std::uint64_t>(1, pictures_a_view * pixels_a_picture);
  const std::size_t count = std::clamp<std::size_t>(kPagePixels / a_view, 1, std::min(kMostViews, views.size()));
  for (std::size_t i = 0; i < count; ++i) {
    choice.views.push_back(views[count == 1 ? 0 : i * (views.size() - 1) / (count - 1)]);
  }
  while (count * a_view / std::uint64_t(choice.factor * choice.factor) > kPagePixels) ++choice.factor;
  return choice;
}

}  // namespace helio::report
