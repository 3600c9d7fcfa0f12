#include "tests/support/random_messages.hpp"

#include <algorithm>
#include <array>
#include <ranges>
#include <utility>

#include "schema/codec/hand_code.hpp"
#include "tests/support/fields.hpp"

namespace hairnet::wire {

std::int64_t RandomMessages::time_ns() {
  return static_cast<std::int64_t>(integer(0, static_cast<std::uint64_t>(kTimeMax_ns))) * (coin() ? 1 : -1);
}

std::string RandomMessages::text() {
  // These characters take one to four bytes in UTF-8. Forty of them stay within the limits of every text, tags
  // included (kTagBytesMax, 256).
  static const std::array<const char*, 5> kCharacters{"a", "?", "\u00e9", "\u6bdb", "\U0001F487"};
  std::string text;
  for (std::size_t n = integer(0, 40); n > 0; --n) text += kCharacters[integer(0, kCharacters.size() - 1)];
  return text;
}

std::vector<std::uint8_t> RandomMessages::bytes(std::size_t count) {
  std::vector<std::uint8_t> out(count);
  for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(integer(0, 255));
  return out;
}

GroomHash RandomMessages::hash() {
  GroomHash hash;
  for (std::uint8_t& byte : hash) byte = static_cast<std::uint8_t>(integer(0, 255));
  return hash;
}

LevelIndex RandomMessages::level(LevelIndex last) {
  return static_cast<LevelIndex>(integer(0, static_cast<std::uint64_t>(last)));
}

Vec3f RandomMessages::vector(float most) {
  const auto coordinate = [&] { return static_cast<float>(real(-most, most)); };
  const float x = coordinate(), y = coordinate(), z = coordinate();
  return {x, y, z};
}

RigidTransform RandomMessages::place(float max_m) {
  const Vec3f axis = vector(1).normalized();
  const Eigen::Quaternionf turn(Eigen::AngleAxisf(static_cast<float>(real(0, 3)), axis));
  return {turn.cast<double>(), vector(max_m).cast<double>()};
}

Pose RandomMessages::pose() {
  Pose pose;
  for (RigidTransform& bone : pose.bones) bone = place(1000);
  return rounded_to_wire(pose);
}

std::vector<Hand> RandomMessages::hands() {
  std::vector<Hand> hands;
  std::size_t next = integer(0, 5);
  // Numbers of shapes ascend from hand to hand and stay below kHandShapesMax. A hand that is 9 km away is within
  // kHandPlaceMax_m (core/touch/hand.hpp).
  while (next < kHandShapesMax && coin()) {
    Hand& hand = hands.emplace_back(Hand{static_cast<std::uint8_t>(next), place(coin() ? 2.f : 9000.f), coin()});
    for (std::size_t n = integer(1, std::min<std::size_t>(kHandShapesMax - next, 7)); n > 0; --n) {
      const Vec3 from = vector(0.1f).cast<double>(), to = from + vector(0.1f).cast<double>();
      hand.shapes.push_back({from, coin() ? to : from, real(0.001, coin() ? 0.02 : 3), coin()});
    }
    next += hand.shapes.size() + integer(0, 3);
  }
  return codec::rounded_to_wire(hands);
}

std::vector<std::uint8_t> RandomMessages::prop_numbers() {
  std::vector<std::uint8_t> numbers(integer(0, 6));
  for (std::uint8_t& number : numbers) number = static_cast<std::uint8_t>(integer(0, kPropsMax - 1));
  return numbers;
}

void RandomMessages::draw(Prop& prop) {
  prop = {static_cast<std::uint8_t>(integer(0, kPropsMax - 1)), {}, place(100), coin()};
  prop.shape = {vector(1).cwiseAbs().cast<double>(), static_cast<float>(real(0.01, 1)), coin()};
}
void RandomMessages::draw(SetProps& set) {
  for (std::size_t n = integer(0, 4); n > 0; --n) draw(set.props.emplace_back());
  set.removed = prop_numbers();
}
void RandomMessages::draw(RoomProps& room) {
  for (std::size_t n = integer(0, 4); n > 0; --n) draw(room.props.emplace_back());
  room.removed = prop_numbers();
  room.all = coin();
}

// The nodes are active or trimmed at random, and each trimmed one follows up to three active ones.
LevelGeometry RandomMessages::geometry() {
  LevelGeometry g;
  g.lattice.origin = vector(1);
  g.lattice.spacing = vector(0.01f).cwiseAbs() + Vec3f::Constant(0.01f);
  for (int& n : g.lattice.dims) n = static_cast<int>(integer(2, 6));
  g.trimmed_begin = {0};
  g.active_nodes = {0};
  for (std::uint32_t node = 1; node < g.lattice.node_count(); ++node) {
    (coin() ? g.active_nodes : g.trimmed_nodes).push_back(node);
  }
  for (std::size_t t = 0; t < g.trimmed_nodes.size(); ++t) {
    for (std::size_t n = integer(0, 3); n > 0; --n) {
      g.trimmed_from.push_back(static_cast<std::uint32_t>(integer(0, g.active_nodes.size() - 1)));
      g.trimmed_weights.push_back(static_cast<float>(real(-1, 1)));
    }
    g.trimmed_begin.push_back(static_cast<std::uint32_t>(g.trimmed_from.size()));
  }
  return g;
}

Frame RandomMessages::frame(std::vector<std::uint8_t>& content) {
  Frame f;
  f.level = level();
  f.discontinuous = coin();
  f.asleep = coin();
  f.evaluated = f.level == LevelIndex::learnt && coin();
  // Strides are 1, 2 or 4 ticks (is_stride(), schema/limits.hpp).
  f.step_stride = static_cast<std::uint8_t>(1 << integer(0, 2));
  // No decoder reads the content here: a packet carries it as plain bytes.
  content = bytes(integer(0, 300));
  f.content = content;
  return f;
}

FrameBatch RandomMessages::frame_batch() {
  FrameBatch batch;
  batch.tick = integer(0, ~std::uint64_t{0});
  batch.sample_time_ns = time_ns();
  auto storage = std::make_shared<std::vector<std::uint8_t>>();
  std::uint32_t member = 0;
  std::vector<std::size_t> begins;
  for (std::size_t n = integer(0, 6); n > 0; --n) {
    std::vector<std::uint8_t> content;
    Frame f = frame(content);
    // Members ascend, by small steps and by such as take a varint of several bytes.
    f.member = member += static_cast<std::uint32_t>(integer(1, coin() ? 3 : 0x0fffffff));
    begins.push_back(storage->size());
    storage->insert(storage->end(), content.begin(), content.end());
    f.content = {};
    batch.frames.push_back(f);
  }
  for (std::size_t i = 0; i < begins.size(); ++i) {
    // The spans are set last, because `storage` moves its bytes while it grows.
    const std::size_t end = i + 1 < begins.size() ? begins[i + 1] : storage->size();
    batch.frames[i].content = std::span(*storage).subspan(begins[i], end - begins[i]);
  }
  batch.storage = std::move(storage);
  if (!batch.frames.empty() && coin()) batch.generations = bytes(batch.frames.size());
  return batch;
}

HairState RandomMessages::hair_state() {
  HairState state;
  // The step is at most kHairStateStepMax_m, 1 mm. There are three integers for each active node.
  state.step_m = static_cast<float>(real(1e-5, 1e-3));
  state.displacements.resize(3 * integer(1, 60));
  for (std::int16_t& d : state.displacements) d = static_cast<std::int16_t>(integer(0, 0xffff));
  if (coin()) state.velocities.assign(state.displacements.rbegin(), state.displacements.rend());
  return state;
}

Observe RandomMessages::observe() {
  Observe o;
  o.mode = static_cast<ObserveMode>(integer(0, 3));
  o.count = static_cast<std::uint32_t>(integer(0, 0xFFFFFFFF));
  o.radius_m = static_cast<float>(real(0, 100));
  if (coin()) o.from = vector(100);
  for (std::size_t n = integer(0, 5); n > 0; --n)
    o.members.push_back(static_cast<std::uint32_t>(integer(0, 0xFFFFFFFF)));
  o.stride = 1u << integer(0, 2);
  if (coin()) o.error_m = static_cast<float>(real(0, 1));
  if (coin()) o.bytes_per_s = static_cast<std::uint32_t>(integer(0, 0xFFFFFFFF));
  return o;
}

void RandomMessages::draw(Hello& hello) {
  hello = {static_cast<std::uint16_t>(integer(0, 0xFFFF)), text(), text(), text(), Role::participant, 0, {}};
  if (coin()) hello.role = Role::observer;
  if (coin()) {
    hello.session = integer(1, ~std::uint64_t{0});
    draw(hello.secret);
  }
  if (coin()) hello.redirects = static_cast<std::uint8_t>(integer(0, 255));
  draw(hello.signs_of_life);
  if (coin()) hello.datagram_layout = static_cast<std::uint8_t>(integer(0, 255));
  if (coin()) hello.trace = integer(1, ~std::uint64_t{0});
}
void RandomMessages::draw(GroomOffer& offer) {
  offer = {hash(), integer(1, ~std::uint64_t{0})};
}
void RandomMessages::draw(PoseBatch& batch) {
  draw(batch.poses);
  draw(batch.hands);
  // An earlier pose belongs to a pose of the batch, and its sequence differs from that pose's.
  for (std::size_t n = batch.poses.empty() ? 0 : integer(0, 6); n > 0; --n) {
    EarlierPose& earlier = batch.earlier.emplace_back();
    draw(earlier.bones);
    earlier.character = batch.poses[integer(0, batch.poses.size() - 1)].character;
    earlier.captured_before_ns = static_cast<std::uint32_t>(integer(0, 1'000'000'000));
    earlier.sequence_before = static_cast<std::uint16_t>(integer(1, 65'535));
  }
}
void RandomMessages::draw(Welcome& w) {
  draw(w.protocol_version);
  draw(w.session);
  w.tick_rate_hz = static_cast<std::uint32_t>(integer(1, kTickRateMax_hz));
  draw(w.tick);
  draw(w.character_count_max);
  draw(w.groom_bytes_max);
  draw(w.room);
  draw(w.secret);
  draw(w.resumed);
  w.resume_grace_s = static_cast<float>(real(0, 100));
  draw(w.pose_delay_ns);
  draw(w.may_set_wind);
  draw(w.signs_of_life);
  draw(w.may_touch);
  draw(w.may_set_props);
  w.others.resize(integer(0, kServersMax));
  for (ServerAt& other : w.others) draw(other);
}
void RandomMessages::draw(GroomData& data) {
  // The chunk of up to 2000 bytes that begins at up to 3000 lies within the groom's 5000 bytes.
  data = {hash(), 5000, integer(0, 3000), bytes(integer(0, 2000))};
}
void RandomMessages::draw(ServerAt& server) {
  // A name, an IPv4 and an IPv6 address.
  constexpr const char* kHosts[] = {"hair-3.example.org", "192.0.2.7", "2001:db8::1"};
  server = {kHosts[integer(0, 2)], static_cast<std::uint16_t>(integer(1, 65535))};
}
void RandomMessages::draw(Error& error) {
  error = {static_cast<ErrorReason>(integer(1, static_cast<std::uint64_t>(kErrorReasonLast))), u32(),
           coin() ? hash() : GroomHash{}, text()};
}
void RandomMessages::draw(Goodbye& goodbye) {
  goodbye = {static_cast<GoodbyeReason>(integer(1, static_cast<std::uint64_t>(kGoodbyeReasonLast))), text()};
}

template <class T>
void RandomMessages::draw(T& value) {
  if constexpr (boost::describe::has_describe_members<T>::value) {
    for_each_field<T>([&](const char*, auto field) { draw(value.*field); });
  } else if constexpr (std::is_same_v<T, std::vector<std::uint8_t>>) {
    value = bytes(integer(1, 2000));
  } else if constexpr (requires { value.has_value(); }) {
    if (coin()) draw(value.emplace());
  } else if constexpr (requires { value.emplace_back(); } && !std::is_same_v<T, std::string>) {
    for (std::size_t n = integer(0, 6); n > 0; --n) draw(value.emplace_back());
  } else if constexpr (std::ranges::range<T> && !std::is_same_v<T, std::string>) {
    for (auto& each : value) draw(each);
  } else if constexpr (std::is_same_v<T, bool>) {
    value = coin();
  } else if constexpr (std::is_floating_point_v<T>) {
    value = static_cast<T>(real(0, 2));
  } else {
    value = static_cast<T>(integer(0, std::numeric_limits<T>::max()));
  }
}

Message RandomMessages::message(std::size_t kind) {
  Message message;
  const auto draw_kind = [&]<std::size_t... I>(std::index_sequence<I...>) {
    // Only the alternative with the index `kind` is made and drawn.
    (void)((kind == I && (draw(message.emplace<I>()), true)) || ...);
  };
  draw_kind(std::make_index_sequence<kMessageKinds>());
  return message;
}

Material RandomMessages::material() {
  Material m;
  for (float* value : {&m.axial_stiffness_n, &m.attachment_stiffness_n_per_m, &m.damping_ratio, &m.ether_mass_ratio,
                       &m.ether_stiffness_per_s2, &m.ether_damping_ratio, &m.root_length_m, &m.metaball_potential_j})
    *value = static_cast<float>(real(0.01, 10));
  m.linear_density_kg_per_m = static_cast<float>(real(1e-7, 1e-3));
  m.air_drag_ns_per_m2 = static_cast<float>(real(0, 1));
  m.thickness_m = static_cast<float>(real(0, 0.1));
  return m;
}

MaterialScale RandomMessages::material_scale() {
  MaterialScale s;
  for (float* value : {&s.stiffness, &s.damping, &s.density, &s.ether_damping, &s.air_drag, &s.gel_per_s2})
    *value = static_cast<float>(real(0.1, 10));
  return s;
}

Wind RandomMessages::wind() {
  Wind w;
  w.mean_m_per_s = vector(20).cast<double>();
  w.gust_ratio = real(0, 1);
  w.gust_period_s = real(1, 100);
  w.turbulence_rms_m_per_s = real(0, 20);
  w.turbulence_scale_m = real(0.3, 100);
  w.seed = integer(0, ~std::uint64_t{0});
  draw(w.carried);
  return w;
}

Groom RandomMessages::groom(std::size_t strand_count) {
  Groom g;
  g.name = text();
  g.group_names = {text(), text()};
  g.materials.base = material();
  for (std::uint16_t group = 0; group < 2; ++group) {
    if (coin()) g.materials.set(group, material());
  }
  for (std::size_t s = 0; s < strand_count; ++s) {
    std::vector<Vec3f> strand(integer(0, 16));
    for (Vec3f& point : strand) point = vector(0.4f);
    g.add_strand(strand, {static_cast<float>(real(1e-5, 1e-4)), static_cast<float>(real(1, 50)),
                          static_cast<float>(real(0, 0.1)), static_cast<std::uint16_t>(integer(0, 1)), coin()});
  }
  if (coin()) add_features(g);
  const std::size_t vertex_count = integer(3, 50);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    g.body.mesh.vertices.push_back(vector(1));
    const auto share = static_cast<float>(real(0, 1));
    // The weights of a vertex add up to 1.
    g.body.bone_weights.push_back({share, 0, 1 - share, 0, 0});
  }
  const auto corner = [&] { return static_cast<std::uint32_t>(integer(0, vertex_count - 1)); };
  for (std::size_t t = integer(0, 50); t > 0; --t) {
    const std::uint32_t a = corner(), b = corner(), c = corner();
    g.body.mesh.triangles.push_back({a, b, c});
  }
  for (Vec3f& joint : g.body.joints) joint = vector(0.5f);
  g.body.fitted_from_roots = coin();
  return g;
}

void RandomMessages::add_features(Groom& g) {
  const auto number = [&](double least, double most) { return static_cast<float>(real(least, most)); };
  const auto group = [&] { return static_cast<std::uint16_t>(integer(0, 1)); };
  const auto points = [&](std::size_t count) {
    std::vector<Vec3f> all(count);
    for (Vec3f& p : all) p = vector(0.4f);
    return all;
  };
  const auto colour = [&] { return Vec3f(vector(1).cwiseAbs()); };
  // Only the second group has a root blend. Both coordinates of its two points rise, as validate() demands.
  if (coin()) g.root_blends = {{}, {{{number(0.1, 1), number(0, 0.5)}, {number(1.1, 9), number(0.5, 1)}}}};
  for (std::uint32_t s = 0; s < g.strand_count(); s += 3)
    g.clumps.push_back({s, static_cast<std::uint16_t>(integer(0, 9)), number(0, 0.01), number(0, 0.01)});
  for (std::size_t i = integer(0, 3); i > 0; --i) {
    g.add_thread(points(integer(2, 9)), {{},
                                         group(),
                                         coin(),
                                         number(0, 0.1),
                                         number(1e-4, 1e-2),
                                         colour(),
                                         number(0, 9),
                                         number(0, 1),
                                         number(0, 99),
                                         number(1e-5, 1e-2),
                                         number(0, 1e-2)});
  }
  for (std::size_t i = integer(0, 3); i > 0; --i) {
    g.add_card(points(2 * integer(2, 6)), {number(1e-5, 1e-4), number(1, 50), number(0, 0.1), group(), coin()});
  }
  for (std::size_t i = integer(0, 3); i > 0; --i) {
    const std::size_t count = integer(3, 12);
    Cloth cloth{{},           group(),        {},
                {},           number(0, 0.1), colour(),
                number(0, 1), number(0, 99),  number(0, 99),
                number(0, 1), number(0, 99),  number(1e-3, 1),
                number(0, 9)};
    for (std::uint32_t t = 0; t + 2 < count; ++t) cloth.triangles.push_back({t, t + 2, t + 1});
    if (coin()) {
      for (std::size_t p = 0; p < count; ++p) cloth.root_distance_m.push_back(number(0, 1));
    }
    g.add_cloth(points(count), cloth);
  }
  for (std::size_t i = g.points.empty() ? 0 : integer(0, 3); i > 0; --i) {
    Knot knot{{}, number(0, 999), number(0, 1), number(0, 0.1)};
    for (std::size_t p = integer(2, 6); p > 0; --p)
      knot.points.push_back(static_cast<std::uint32_t>(integer(0, g.points.size() - 1)));
    g.knots.push_back(knot);
  }
}

RecordingHeader RandomMessages::recording_header() {
  RecordingHeader h;
  h.tick_rate_hz = static_cast<std::uint32_t>(integer(1, 120));
  h.substep_count = static_cast<std::int32_t>(integer(1, 8));
  h.iterations = static_cast<std::int32_t>(integer(1, 64));
  for (double& g : h.gravity) g = real(-20, 20);
  h.wind = wind();
  return h;
}

RecordedTick RandomMessages::recorded_tick() {
  RecordedTick t;
  t.tick = u64();
  t.sample_time_ns = time_ns();
  t.state_hash = u64();
  for (std::size_t n = integer(0, 3); n > 0; --n) t.removed.push_back(u64());
  for (std::size_t n = integer(0, 3); n > 0; --n)
    t.added.push_back({u64(), hash(), static_cast<std::uint32_t>(integer(0, 99)), coin(), level(), pose()});
  for (std::size_t n = integer(0, 3); n > 0; --n) t.levels.push_back({u64(), level()});
  for (std::size_t n = integer(0, 3); n > 0; --n) t.materials.push_back({u64(), material_scale()});
  for (std::size_t n = integer(0, 2); n > 0; --n)
    t.winds.push_back({static_cast<std::uint32_t>(integer(0, 99)), wind()});
  for (std::size_t n = integer(0, 3); n > 0; --n)
    t.strides.push_back({u64(), static_cast<std::uint8_t>(1 << integer(0, 2))});
  for (std::size_t n = integer(0, 3); n > 0; --n) t.suspensions.push_back({u64(), coin()});
  for (std::size_t n = integer(0, 70); n > 0; --n) {
    RecordedState state;
    state.character = u64();
    for (std::size_t i = integer(0, 4); i > 0; --i) {
      state.displacements.push_back(vector(1));
      state.velocities.push_back(vector(1));
    }
    t.states.push_back(std::move(state));
  }
  for (std::size_t n = integer(0, 5); n > 0; --n) t.poses.push_back({u64(), coin(), pose()});
  if (coin()) add_touch(t);
  return t;
}

// Draws a body for recordings, which store doubles. Its numbers are not rounded to floats, so a recording that
// rounded them would show.
TouchBody RandomMessages::touch_body(std::uint8_t number) {
  TouchBody body{{u32(), number}, capsule(real(0, 1), real(0.01, 1)), {}, coin(), coin()};
  body.shape.is_inside_out = coin();
  body.place.rotation = Quat(Eigen::AngleAxisd(real(0, 3), vector(1).cast<double>().normalized()));
  for (double& x : body.place.position) x = real(-1000, 1000);
  return body;
}

void RandomMessages::add_touch(RecordedTick& t) {
  for (RecordedAdd& added : t.added) added.owner = u32();
  for (std::size_t n = integer(0, 3); n > 0; --n) {
    TouchRule rule{static_cast<TouchAudience>(integer(0, 3))};
    for (std::size_t i = integer(0, 4); i > 0; --i) rule.chosen.push_back(u32());
    // The decoder of recordings refuses a list of sessions that does not ascend, and bodies that do not ascend by
    // their keys.
    std::ranges::sort(rule.chosen);
    t.touch_rules.push_back({u64(), rule});
  }
  for (std::size_t n = integer(0, 3); n > 0; --n) {
    RecordedTick::RoomBodies room{static_cast<std::uint32_t>(integer(0, 99)), {}};
    for (std::size_t i = integer(0, 5); i > 0; --i) room.bodies.push_back(touch_body(static_cast<std::uint8_t>(i)));
    std::ranges::sort(room.bodies, {}, &TouchBody::key);
    t.bodies.push_back(std::move(room));
  }
  const auto key = [&] { return TouchKey{u32(), static_cast<std::uint8_t>(integer(0, 255))}; };
  for (std::size_t n = integer(0, 3); n > 0; --n)
    t.releases.push_back({u64(), key(), static_cast<Release>(integer(0, 2))});
  for (std::size_t n = integer(0, 3); n > 0; --n)
    // A third of the unit cube keeps the place near the hand.
    t.grabs.push_back({u64(), {key(), vector(1).cast<double>() / 3, real(0, kGrabRadiusMax_m)}});
}

}  // namespace hairnet::wire
