// heliograph replay.
#include "cli_test.h"
#include "daemon_process.h"

namespace helio::test {
namespace {

class CliReplay : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    write_file(folder_ / "overflow.gltf", overflowing_gltf());
  }
  std::vector<std::string> render_arguments() const {
    return {"render", "overflow.gltf", "--environment", "0,0,0", "--size", "40x30", "--samples", "64"};
  }
};

TEST_F(CliReplay, ARenderNamesItsInvalidSamplesAndReplayShowsTheFirst) {
  const auto json = heliograph_json(render_arguments());
  EXPECT_GT(json["invalid_samples"], 0);
  const std::string token = json["replay_token"];
  const ProcessResult told = heliograph({"replay", token, "overflow.gltf", "--environment", "0,0,0"});
  EXPECT_EQ(told.exit_code, 0) << told.err;
  EXPECT_EQ(told.err, "");
  const std::string pixel = "pixel " + json["first_invalid"]["x"].dump() + "," + json["first_invalid"]["y"].dump() +
                            ", half " + json["first_invalid"]["half"].dump() + ", sample " +
                            json["first_invalid"]["index"].dump();
  for (const std::string& part :
       {pixel, std::string("first not finite at vertex 1: the light sample's contribution"), std::string("vertex 1\n"),
        std::string("shadow ray arrives"), std::string(">>> first not finite"), std::string("radiance (inf, inf, inf)")}) {
    EXPECT_NE(told.out.find(part), std::string::npos) << part << "\n" << told.out;
  }
  const auto as_json = heliograph_json({"replay", token, "overflow.gltf", "--environment", "0,0,0"});
  EXPECT_EQ(as_json["first_not_finite"], "the light sample's contribution");
  EXPECT_EQ(as_json["sample"]["width"], 40);
  EXPECT_EQ(as_json["vertices"][0]["light"]["contribution"]["x"], "Infinity");

  const ProcessResult warned = heliograph(render_arguments());
  EXPECT_EQ(warned.exit_code, 0);
  EXPECT_NE(warned.err.find("heliograph replay hg1-"), std::string::npos) << warned.err;
}

TEST_F(CliReplay, ADaemonThatHasTheSceneNeedsNoFile) {
  const DaemonProcess daemon({"--render-threads", "1"});
  ASSERT_NE(daemon.address(), "");
  auto arguments = render_arguments();
  arguments.insert(arguments.end(), {"--server", daemon.address()});
  const std::string token = heliograph_json(arguments)["replay_token"];
  EXPECT_EQ(heliograph_json({"replay", token, "--server", daemon.address()})["first_not_finite_vertex"], 1);
}

TEST_F(CliReplay, BadInputIsRefusedWithItsReason) {
  const std::string token = heliograph_json(render_arguments())["replay_token"];
  struct Case {
    std::vector<std::string> arguments;
    int exit_code;
    std::string part;
  };
  std::string mistyped = token;
  mistyped[20] = mistyped[20] == 'x' ? 'y' : 'x';
  const Case cases[] = {
      {{"replay"}, 2, "TOKEN: is missing"},
      {{"replay", token}, 2, "FILE: is missing"},
      {{"replay", mistyped, "overflow.gltf", "--environment", "0,0,0"}, 2, "checksum"},
      {{"replay", "quad.gltf", "quad.gltf"}, 2, "does not start like a replay token"},
      {{"replay", token, "overflow.gltf"}, 3, "environment '0,0,0'"},
      {{"replay", token, "quad.gltf", "--environment", "0,0,0"}, 3, "quad.gltf is not the token's scene"},
      {{"replay", token, "none.gltf"}, 3, "none.gltf"},
  };
  for (const Case& c : cases) {
    const ProcessResult result = heliograph(c.arguments);
    EXPECT_EQ(result.exit_code, c.exit_code) << result.err;
    EXPECT_NE(result.err.find(c.part), std::string::npos) << c.part << " in " << result.err;
    expect_one_line(result.err);
  }
}

}  // namespace
}  // namespace helio::test
