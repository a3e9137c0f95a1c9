// Clients of a later version: what they send beyond this protocol is ignored and named, what they encode otherwise read.
#include <google/protobuf/unknown_field_set.h>

#include <bit>

#include "client/render_client.h"
#include "server/base/parse_message.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using google::protobuf::Message;
using grpc::StatusCode;

// Sets field `number`, which this version does not have.
void add_unknown(Message& message, int number) {
  message.GetReflection()->MutableUnknownFields(&message)->AddVarint(number, 5);
}

class NewerClientTest : public ServiceTest {
 protected:
  void SetUp() override {
    start();
    scene_ = load_quad(2);
  }

  // A unary call; the fields that it says it ignored.
  template <class Request, class Response>
  std::string ignored(grpc::Status (pb::RenderService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request, Response* response) {
    grpc::ClientContext context;
    const grpc::Status status = (stub().*method)(&context, request, response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return metadata(context);
  }

  static std::string metadata(const grpc::ClientContext& context) {
    const auto found = context.GetServerTrailingMetadata().find(kIgnoredFieldsKey);
    if (found == context.GetServerTrailingMetadata().end()) return {};
    return std::string(found->second.data(), found->second.size());
  }

  std::string scene_;
};

bool is_notice(const pb::StreamResponse& message, const std::string& part) {
  return message.has_notice() && message.notice().severity() == pb::Notice::SEVERITY_WARNING &&
         message.notice().text().find(part) != std::string::npos;
}

TEST_F(NewerClientTest, AStreamIgnoresUnknownFieldsAndNamesThemOnceInANotice) {
  const std::string session = create_session(scene_, 16, 16, 1);
  StreamClient client(stub());
  client.start_reading();
  pb::StreamRequest hello, open, unknown_kind, request;
  add_unknown(hello, 100);
  client.send(hello);  // even before open
  open.mutable_open()->set_session_id(session);
  add_unknown(*open.mutable_open()->mutable_format(), 50);
  client.send(open);
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) {
    return is_notice(m, ") does not know and ignores field 100 of StreamRequest, field 50 of open.format");
  }));
  add_unknown(unknown_kind, 101);
  client.send(unknown_kind);
  for (std::uint64_t id = 1; id <= 3; ++id) {
    *request.mutable_view() = view(id);
    add_unknown(*request.mutable_view()->mutable_camera(), 40);
    client.send(request);
    ASSERT_TRUE(client.reader().wait_for_frame_end(id));
  }
  // All of them again, so that a notice which takes the place of another loses nothing.
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) {
    return is_notice(m, "field 100 of StreamRequest, field 50 of open.format, field 101 of StreamRequest, "
                        "field 40 of view.camera");
  }));
  int notices = 0;
  for (const auto& message : client.reader().messages()) notices += message.has_notice();
  EXPECT_LE(notices, 3) << "told when it is new, not for every view";
  EXPECT_TRUE(client.reader().messages().front().has_opened()) << "opened is the first message";
}

TEST_F(NewerClientTest, AWatchNamesThemInANotice) {
  pb::WatchFramesRequest request;
  request.set_session_id(create_session(scene_, 8, 8, 1));
  add_unknown(request, 30);
  grpc::ClientContext context;
  const auto call = stub().WatchFrames(&context, request);
  pb::StreamResponse message;
  ASSERT_TRUE(call->Read(&message) && message.has_opened());
  ASSERT_TRUE(call->Read(&message));
  EXPECT_TRUE(is_notice(message, "field 30 of WatchFramesRequest")) << message.ShortDebugString();
  context.TryCancel();
  call->Finish();
}

TEST_F(NewerClientTest, OtherCallsNameThemInTheTrailingMetadata) {
  pb::CreateSessionRequest create;
  create.set_scene_id(scene_);
  create.mutable_settings()->set_width(8);
  create.mutable_settings()->set_height(8);
  add_unknown(*create.mutable_settings(), 90);
  add_unknown(create, 91);
  pb::CreateSessionResponse created;
  EXPECT_EQ(ignored(&pb::RenderService::Stub::CreateSession, create, &created),
            "field 91 of CreateSessionRequest, field 90 of settings");

  pb::EditSceneRequest edit;
  edit.set_scene_id(scene_);
  for (int i = 0; i < 2; ++i) {  // of several messages: named once
    edit.add_edits()->mutable_material()->set_index(0);
    edit.mutable_edits(i)->mutable_material()->mutable_emission()->set_x(3);
    add_unknown(*edit.mutable_edits(i)->mutable_material(), 92);
  }
  pb::EditSceneResponse edited;
  EXPECT_EQ(ignored(&pb::RenderService::Stub::EditScene, edit, &edited), "field 92 of edits.material");
  EXPECT_NE(edited.scene().scene_id(), scene_) << "what is known was done";

  pb::ListScenesResponse list;
  EXPECT_EQ(ignored(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &list), "");

  pb::RunJobRequest job;
  job.set_scene_id(scene_);
  *job.mutable_settings() = create.settings();
  job.mutable_budget()->set_samples(1);
  grpc::ClientContext job_context;
  const auto call = stub().RunJob(&job_context, job);
  pb::RunJobResponse answer;
  while (call->Read(&answer)) {
  }
  EXPECT_TRUE(call->Finish().ok());
  EXPECT_EQ(metadata(job_context), "field 90 of settings");

  Upload upload;
  auto messages = upload.messages();
  add_unknown(*messages[0].mutable_begin(), 93);
  messages.insert(messages.begin() + 1, pb::LoadSceneRequest());
  add_unknown(messages[1], 94);  // of a kind that is not known
  grpc::ClientContext load_context;
  pb::LoadSceneResponse loaded;
  const auto writer = stub().LoadScene(&load_context, &loaded);
  for (const auto& message : messages) ASSERT_TRUE(writer->Write(message));
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(metadata(load_context), "field 93 of begin, field 94 of LoadSceneRequest");

  pb::LoadReferenceRequest reference[3];
  reference[0].mutable_begin()->set_bytes(1);
  reference[0].mutable_begin()->set_sha256(std::string(32, 'x'));
  add_unknown(*reference[0].mutable_begin(), 95);
  add_unknown(reference[1], 96);
  reference[2].set_data("x");
  grpc::ClientContext reference_context;
  pb::LoadReferenceResponse unread;
  const auto sender = stub().LoadReference(&reference_context, &unread);
  for (const auto& message : reference) ASSERT_TRUE(sender->Write(message));
  sender->WritesDone();
  EXPECT_NE(sender->Finish().error_message().find("begin.sha256"), std::string::npos) << "all messages were read";
  EXPECT_EQ(metadata(reference_context), "field 95 of begin, field 96 of LoadReferenceRequest");
}

TEST_F(NewerClientTest, TheClientLibrarySaysWhatWasIgnored) {
  std::vector<std::string> notices;
  ConnectOptions options;
  options.notice = [&](const std::string& text) { notices.push_back(text); };
  const auto client = RenderClient::connect(server_->address(), options);
  ASSERT_TRUE(client.ok());
  pb::CreateSessionRequest create;
  create.set_scene_id(scene_);
  ASSERT_TRUE((*client)->create_session(create).ok());
  EXPECT_TRUE(notices.empty());
  add_unknown(create, 91);
  ASSERT_TRUE((*client)->create_session(create).ok());
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find("is older than this client and ignored field 91 of CreateSessionRequest"), std::string::npos)
      << notices[0];
}

// An edit of a kind that is not known cannot be left out: the answer would be another scene than was asked for.
TEST_F(NewerClientTest, AnEditOfAnUnknownKindIsRefused) {
  pb::EditSceneRequest edit;
  edit.set_scene_id(scene_);
  add_unknown(*edit.add_edits(), 20);
  pb::EditSceneResponse edited;
  expect_status(call(&pb::RenderService::Stub::EditScene, edit, &edited), StatusCode::INVALID_ARGUMENT,
                {"edits[0]", "object, material, light"});
}

// Field 3 of ObjectEdit, a packed repeated double, with a tag for each number.
TEST_F(NewerClientTest, RepeatedNumbersAreReadInBothEncodings) {
  pb::EditSceneRequest packed;
  packed.set_scene_id(scene_);
  pb::ObjectEdit& object = *packed.add_edits()->mutable_object();
  object.set_index(0);
  pb::EditSceneRequest unpacked = packed;
  const int field = pb::ObjectEdit::kTransformFieldNumber;
  Message& bare = *unpacked.mutable_edits(0)->mutable_object();
  for (const double number : {1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}) {
    object.add_transform(number);
    bare.GetReflection()->MutableUnknownFields(&bare)->AddFixed64(field, std::bit_cast<std::uint64_t>(number));
  }
  ASSERT_NE(packed.SerializeAsString(), unpacked.SerializeAsString());
  pb::EditSceneResponse one, other;
  EXPECT_EQ(ignored(&pb::RenderService::Stub::EditScene, packed, &one), "");
  EXPECT_EQ(ignored(&pb::RenderService::Stub::EditScene, unpacked, &other), "");
  EXPECT_EQ(one.scene().scene_id(), other.scene().scene_id());
  EXPECT_NE(one.scene().scene_id(), scene_);
}

TEST(UnknownFields, AreBoundedInNumber) {
  pb::View view;
  for (int number = 100; number < 1000; ++number) add_unknown(view, number);
  EXPECT_EQ(unknown_fields(view).size(), kMaxUnknownFields);
  pb::RunJobRequest job;
  for (int i = 0; i < 1000; ++i) add_unknown(*job.add_views(), 100 + i);
  EXPECT_EQ(unknown_fields(job).size(), kMaxUnknownFields);
}

}  // namespace
}  // namespace helio::test
