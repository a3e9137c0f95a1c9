// heliograph edit.
#include "cli_test.h"
#include "daemon_process.h"

namespace helio::test {
namespace {

class CliEdit : public CliTest {};

TEST_F(CliEdit, EditsASceneOnADaemonInSteps) {
  const DaemonProcess daemon({"--render-threads", "1"});
  ASSERT_NE(daemon.address(), "");
  const auto edit = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "edit");
    arguments.insert(arguments.end(), {"--server", daemon.address()});
    return heliograph_json(arguments);
  };
  const auto bright = edit({"quad.gltf", "--environment", "0,0,0", "--material", "#0=emission:3,2,1;roughness:0.5"});
  EXPECT_EQ(bright["shares_bvh"], true);
  EXPECT_EQ(bright["already_there"], false);
  EXPECT_LT(bright["own_bytes"], bright["memory_bytes"]);
  const std::string id = bright["scene_id"];
  // Moved twice as far in two ways.
  const auto far = edit({"--scene-id", id, "--object", "#0=move:1,0,0;scale:2"});
  EXPECT_EQ(far["shares_bvh"], false);
  EXPECT_EQ(far["edited_from"], bright["edited_from"]);
  const auto same = edit({"--scene-id", id, "--object", "#0=matrix:2,0,0,2,0,2,0,0,0,0,2,0"});
  EXPECT_EQ(same["scene_id"], far["scene_id"]);
  EXPECT_EQ(same["already_there"], true);
}

TEST_F(CliEdit, TellsWhatItDid) {
  const ProcessResult told =
      heliograph({"edit", "quad.gltf", "--material", "#0=color:0.5,0.5,0.5", "--environment-light", "scale:2",
                  "--environment", "1,1,1", "--object", "#0=turn:0,1,0,90"});
  EXPECT_EQ(told.exit_code, 0) << told.err;
  EXPECT_NE(told.out.find("of its own"), std::string::npos) << told.out;
}

TEST_F(CliEdit, BadInputIsRefusedWithItsReason) {
  struct Case {
    std::vector<std::string> arguments;
    std::vector<std::string> parts;
  };
  const std::vector<Case> cases = {
      {{"quad.gltf"}, {"nothing to change"}},
      {{"quad.gltf", "--material", "color:1,1,1"}, {"--material", "TARGET=key:value"}},
      {{"quad.gltf", "--material", "#x=color:1,1,1"}, {"'#x' is not # and a number"}},
      {{"quad.gltf", "--material", "a=colour:1,1,1"}, {"'colour:1,1,1' is none of color:r,g,b, emission:r,g,b"}},
      {{"quad.gltf", "--material", "a=color:1,1"}, {"'color:1,1' is not color:r,g,b"}},
      {{"quad.gltf", "--light", "a=scale:nan", "--object", "b=turn:0,0,0,1"}, {"'scale:nan'", "the axis is zero"}},
      {{"quad.gltf", "--material", "Lamp=color:1,1,1"}, {"there is no material 'Lamp'; allowed: "}},
      {{"quad.gltf", "--material", "#0=roughness:1.5"}, {"edits[0].material.roughness: 1.5; allowed: [0, 1]"}},
      {{"quad.gltf", "--scene-id", "x", "--light", "a=scale:2"}, {"--scene-id: is given beside FILE", "--server"}},
  };
  for (const Case& c : cases) {
    std::vector<std::string> arguments = c.arguments;
    arguments.insert(arguments.begin(), "edit");
    const ProcessResult refused = heliograph(arguments);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    expect_one_line(refused.err);
    for (const std::string& part : c.parts) {
      EXPECT_NE(refused.err.find(part), std::string::npos) << part << "\n" << refused.err;
    }
  }
}

}  // namespace
}  // namespace helio::test
