#include "server/jobs/session_record.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/stream/settings_messages.h"

namespace helio {
namespace {

using Json = nlohmann::json;

constexpr int kVersion = 1;

Json to_json(const V3d& v) {
  return {v.x, v.y, v.z};
}

void read(const Json& from, V3d& to) {
  for (int i = 0; i < 3; ++i) to[i] = from.at(std::size_t(i)).get<double>();
}

// A pose as it is: the vectors that a view was sent with may come to others when they are made orthonormal again.
Json to_json(const View& view) {
  const CameraPose& pose = view.camera;
  return {{"id", view.id},
          {"time_s", view.time_s},
          {"exposure", view.exposure},
          {"orthographic", pose.projection == Projection::orthographic},
          {"position", to_json(pose.position)},
          {"right", to_json(pose.right)},
          {"up", to_json(pose.up)},
          {"forward", to_json(pose.forward)},
          {"vertical_fov", pose.vertical_fov},
          {"half_height", pose.half_height},
          {"lens_radius", pose.lens_radius},
          {"focus_distance", pose.focus_distance},
          {"aspect", pose.aspect}};
}

View read_view(const Json& from) {
  View view;
  from.at("id").get_to(view.id);
  from.at("time_s").get_to(view.time_s);
  from.at("exposure").get_to(view.exposure);
  CameraPose& pose = view.camera;
  pose.projection = from.at("orthographic").get<bool>() ? Projection::orthographic : Projection::perspective;
  read(from.at("position"), pose.position);
  read(from.at("right"), pose.right);
  read(from.at("up"), pose.up);
  read(from.at("forward"), pose.forward);
  from.at("vertical_fov").get_to(pose.vertical_fov);
  from.at("half_height").get_to(pose.half_height);
  from.at("lens_radius").get_to(pose.lens_radius);
  from.at("focus_distance").get_to(pose.focus_distance);
  from.at("aspect").get_to(pose.aspect);
  return view;
}

Json bytes_of(const google::protobuf::MessageLite& message) {
  const std::string bytes = message.SerializeAsString();
  return Json::binary(std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
}

template <class Message>
Message message_of(const Json& bytes) {
  const Json::binary_t& binary = bytes.get_binary();
  Message message;
  if (!message.ParseFromArray(binary.data(), int(binary.size())))
    throw Json::other_error::create(501, "a message cannot be read", &bytes);
  return message;
}

}  // namespace

std::string SessionRecord::write() const {
  Json json{{"version", kVersion},
            {"scene", scene_id},
            {"owner", owner},
            {"settings", bytes_of(to_message(settings))},
            {"budget", bytes_of(to_message(budget))},
            {"grace_s", grace_s},
            {"kept_s", kept_s},
            {"build", build},
            {"without", without}};
  if (view) json["view"] = to_json(*view);
  const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
  return {bytes.begin(), bytes.end()};
}

Result<SessionRecord> SessionRecord::read(const std::string& bytes, const RenderLimits& limits) {
  const auto refused = [](const std::string& why) { return Error{ErrorCode::internal, why, {}}; };
  SessionRecord record;
  Problems problems;
  try {
    const Json json = Json::from_cbor(bytes);
    if (const int version = json.at("version").get<int>(); version != kVersion)
      return refused(fmt::format("has version {}; this program reads version {}", version, kVersion));
    json.at("scene").get_to(record.scene_id);
    json.at("owner").get_to(record.owner);
    record.settings = read_settings(message_of<pb::RenderSettings>(json.at("settings")), limits, "settings", problems);
    record.budget = read_budget(message_of<pb::Budget>(json.at("budget")), "budget", problems);
    json.at("grace_s").get_to(record.grace_s);
    json.at("kept_s").get_to(record.kept_s);
    json.at("build").get_to(record.build);
    json.at("without").get_to(record.without);
    if (json.contains("view")) record.view = read_view(json.at("view"));
  } catch (const Json::exception& exception) {
    return refused(exception.what());
  }
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
