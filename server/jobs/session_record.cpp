#include "server/jobs/session_record.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <vector>

#include "server/jobs/session_record.pb.h"
#include "server/state/sealed_message.h"
#include "server/stream/settings_messages.h"

namespace helio {
namespace {

using Message = heliograph::kept::SessionRecord;

constexpr std::uint32_t kVersion = 2;

void write(const V3d& from, Message::Vector& to) {
  to.set_x(from.x);
  to.set_y(from.y);
  to.set_z(from.z);
}

V3d read(const Message::Vector& from) {
  return {from.x(), from.y(), from.z()};
}

void write(const View& from, Message::View& to) {
  const CameraPose& pose = from.camera;
  to.set_id(from.id);
  to.set_time_s(from.time_s);
  to.set_exposure(from.exposure);
  to.set_orthographic(pose.projection == Projection::orthographic);
  write(pose.position, *to.mutable_position());
  write(pose.right, *to.mutable_right());
  write(pose.up, *to.mutable_up());
  write(pose.forward, *to.mutable_forward());
  to.set_vertical_fov(pose.vertical_fov);
  to.set_half_height(pose.half_height);
  to.set_lens_radius(pose.lens_radius);
  to.set_focus_distance(pose.focus_distance);
  to.set_aspect(pose.aspect);
  if (!from.gaze) return;
  to.mutable_gaze()->set_x(from.gaze->x);
  to.mutable_gaze()->set_y(from.gaze->y);
}

View read(const Message::View& from) {
  View view;
  view.id = from.id();
  view.time_s = from.time_s();
  view.exposure = from.exposure();
  CameraPose& pose = view.camera;
  pose.projection = from.orthographic() ? Projection::orthographic : Projection::perspective;
  pose.position = read(from.position());
  pose.right = read(from.right());
  pose.up = read(from.up());
  pose.forward = read(from.forward());
  pose.vertical_fov = from.vertical_fov();
  pose.half_height = from.half_height();
  pose.lens_radius = from.lens_radius();
  pose.focus_distance = from.focus_distance();
  pose.aspect = from.aspect();
  if (from.has_gaze()) view.gaze = Gaze{from.gaze().x(), from.gaze().y()};
  return view;
}

}  // namespace

std::string SessionRecord::write() const {
  Message message;
  message.set_scene_id(scene_id);
  message.set_owner(owner);
  *message.mutable_settings() = to_message(settings);
  *message.mutable_budget() = to_message(budget);
  message.set_grace_s(grace_s);
  message.set_kept_s(kept_s);
  if (view) helio::write(*view, *message.mutable_view());
  message.set_build(build);
  message.set_without(without);
  const std::vector<std::uint8_t> bytes = seal(message, kVersion);
  return {bytes.begin(), bytes.end()};
}

Result<SessionRecord> SessionRecord::read(const std::string& bytes, const RenderLimits& limits) {
  const auto refused = [](const std::string& why) { return Error{ErrorCode::internal, why, {}}; };
  Message message;
  if (const Status found = unseal(bytes, kVersion, message); !found.ok())
    return refused("its record " + found.error().message);
  SessionRecord record;
  Problems problems;
  record.scene_id = message.scene_id();
  record.owner = message.owner();
  record.settings = read_settings(message.settings(), limits, "settings", problems);
  record.budget = read_budget(message.budget(), "budget", problems);
  record.grace_s = message.grace_s();
  record.kept_s = message.kept_s();
  if (message.has_view()) record.view = helio::read(message.view());
  record.build = message.build();
  record.without = message.without();
  if (record.view) {
    validate(*record.view, "view", problems);
    if (record.view->id == 0) problems.add("view.id", "0; allowed: from 1 on");
  }
  if (!(record.grace_s > 0) || !std::isfinite(record.grace_s))
    problems.add("grace_s", fmt::format("{}; allowed: more than 0 seconds", record.grace_s));
  if (!problems.empty()) return refused(problems.to_error().message);
  if (const Status fits = check_film_size(record.settings, limits, "settings"); !fits.ok()) return fits.error();
  return record;
}

}  // namespace helio
