#include "tests/wasm/session.hpp"

#include <utility>

namespace hairnet::same_bits {

// A step is its kind (1 byte), its time (8 bytes) and a block: the length (4 bytes) and the bytes. header_session.mjs
// reads the same layout.
Bytes written(std::span<const Step> steps) {
  Writer to;
  for (const Step& step : steps) to.put(step.kind).put(step.now_ns).put_block(step.bytes);
  return to.bytes();
}

std::vector<Step> read_steps(std::span<const std::uint8_t> bytes) {
  Reader from(bytes);
  std::vector<Step> steps;
  while (!from.is_at_end()) {
    Step& step = steps.emplace_back();
    step.kind = from.take<StepKind>();
    step.now_ns = from.take<std::int64_t>();
    const auto block = from.take_block();
    step.bytes.assign(block.begin(), block.end());
  }
  return steps;
}

// A pose is 7 doubles for each bone: the rotation as x y z w, then the position, m.
Bytes written(const Pose& pose) {
  Writer to;
  for (const RigidTransform& bone : pose.bones) {
    for (const double number : bone.rotation.coeffs()) to.put(number);
    for (const double number : bone.position) to.put(number);
  }
  return to.bytes();
}

Pose read_pose(std::span<const std::uint8_t> bytes) {
  Reader from(bytes);
  Pose pose;
  for (RigidTransform& bone : pose.bones) {
    for (double& number : bone.rotation.coeffs()) number = from.take<double>();
    for (double& number : bone.position) number = from.take<double>();
  }
  return pose;
}

SessionClient::SessionClient()
    : core_(link::LinkCoreOptions()),
      conversation_(new link::CoreConversation(core_)),
      room_(std::unique_ptr<link::Conversation>(conversation_)) {
  core_.start();
}

std::vector<Bytes> SessionClient::take(const Step& step) {
  // The order is that of a client's loop: time passes, the connection opens if the core wants one, something arrives or
  // is asked for, and then the room moves on. Both sides of the comparison must keep to it.
  conversation_->set_now(step.now_ns);
  core_.poll(step.now_ns);
  if (core_.wants_connection()) {
    core_.on_opening(step.now_ns);
    core_.on_open(step.now_ns);
  }
  switch (step.kind) {
    case StepKind::pass:
      break;
    case StepKind::packet:
      core_.on_bytes(step.bytes, step.now_ns);
      break;
    case StepKind::add: {
      const auto added = room_.add_character(std::make_shared<const Bytes>(step.bytes));
      HAIRNET_ASSERT(added);
      break;
    }
    case StepKind::pose: {
      // Own characters are numbered from 1, and the session has one.
      const auto pushed = room_.push(1, read_pose(step.bytes));
      HAIRNET_ASSERT(pushed);
      break;
    }
    case StepKind::lose:
      core_.on_closed("the cable", step.now_ns);
      break;
  }
  room_.advance();
  record();
  std::vector<Bytes> packets;
  for (Bytes packet = core_.take_packet(step.now_ns); !packet.empty(); packet = core_.take_packet(step.now_ns)) {
    sent_.insert(sent_.end(), packet.begin(), packet.end());
    packets.push_back(std::move(packet));
  }
  return packets;
}

// Notes the events of this step, and the time, hair and head of every member that is shown. The results are compared as
// whole lists, so one step that differs makes the comparison fail.
void SessionClient::record() {
  for (const room::Event& event : room_.take_events()) events_ += room::describe(event) + "\n";
  for (const auto& [number, member] : room_.members()) {
    const link::Playout::Sample& sample = member->sample;
    times_.push_back(sample.time_ns);
    coefficients_.insert(coefficients_.end(), sample.coefficients.begin(), sample.coefficients.end());
    std::vector<Vec3f> scratch;
    const std::span<const Vec3f> nodes = nodes_of(sample.lattice(), scratch);
    displacements_.insert(displacements_.end(), nodes.begin(), nodes.end());
    if (!sample.valid) continue;
    const RigidTransform& head = sample.pose.head();
    poses_.insert(poses_.end(), head.rotation.coeffs().begin(), head.rotation.coeffs().end());
    poses_.insert(poses_.end(), head.position.begin(), head.position.end());
  }
}

void SessionClient::write(Results& results) const {
  results.equal("packets sent", sent_);
  results.equal("events", events_);
  results.equal("times shown", times_);
  results.equal("coefficients shown", coefficients_);
  results.equal("nodes shown", displacements_);
  // Heads alone may differ, by 1e-9: interpolated rotations use the sine of the C library.
  results.near(1e-9, "heads shown", poses_);
}

}  // namespace hairnet::same_bits
