#include <algorithm>

#include "client/c/handles.hpp"
#include "client/c/sockets.hpp"

namespace hairnet::c {
namespace {

// The options of the conversation. The error is one line that names the field.
Result<link::LinkCoreOptions> core_options(const hairnet_options& options) {
  link::LinkCoreOptions core;
  core.client_name = options.name == nullptr ? "hairnet" : options.name;
  core.room = text_or_empty(options.room);
  core.token = text_or_empty(options.token);
  core.role = options.is_observer != 0 ? wire::Role::observer : wire::Role::participant;
  core.reconnect = options.no_reconnect == 0;
  core.connect_timeout_s = options.connect_timeout_s;
  core.give_up_after_s = options.give_up_after_s;
  core.trace = options.trace;
  // Hair of a groom that is not here cannot be drawn, so its basis and network are not downloaded before it.
  core.files_wait_for_grooms = true;
  // Texts are checked before anything connects: a server's refusal would come late and say less.
  if (!core.room.empty() && !wire::is_room_name(core.room))
    return Refusal("room: a name has at most 64 letters, digits, dots, hyphens and underscores");
  if (core.token.size() > wire::kTokenBytesMax) return Refusal("token: longer than 4096 bytes");
  if (!(options.connect_timeout_s > 0 && options.connect_timeout_s <= 3600))
    return Refusal("connect_timeout_s is not in 0 to 3600");
  if (!(options.give_up_after_s >= 0 && options.give_up_after_s <= 1e9))
    return Refusal("give_up_after_s is not in 0 to 1e9");
  return core;
}

Result<wire::Observe> observe_of(const hairnet_options& options) {
  wire::Observe observe;
  // An empty list observes nobody; own characters are always included.
  if (options.own_only != 0) observe.mode = wire::ObserveMode::list;
  observe.error_m = options.error_m;
  observe.bytes_per_s = options.bytes_per_s;
  if (std::string error = wire::validate(observe); !error.empty()) return Refusal(std::move(error));
  return observe;
}

// Returns null for a number that is no own character, for which groom_of() gives zeros.
room::Room* own_room(hairnet_room* room, std::uint32_t own) {
  return room->room->groom_of(own) == wire::GroomHash{} ? nullptr : room->room.get();
}

// Makes the scene of what the room shows now.
void show(hairnet_room& room) {
  hairnet_scene& scene = room.scene;
  // The scene is made again at each advance, so that its places stay valid until the next one.
  scene.shown.clear();
  for (const auto& [number, member] : room.room->members()) {
    const link::Playout::Sample& sample = member->sample;
    hairnet_scene::Shown& shown = scene.shown.emplace_back();
    shown.member = member;
    // The geometry shares the ownership of its basis, so the lattice stays valid while a caller reads the scene.
    shown.geometry = sample.geometry();
    shown.lattice = sample.lattice();
  }
  forget_unused(scene);
}

hairnet_room_state state_of(room::State state) {
  switch (state) {
    case room::State::connecting:
      return HAIRNET_CONNECTING;
    case room::State::connected:
      return HAIRNET_CONNECTED;
    case room::State::reconnecting:
      return HAIRNET_RECONNECTING;
    case room::State::closed:
      break;
  }
  return HAIRNET_CLOSED;
}

// One function for each event of a room; fields that an event does not name stay 0.
void write(const room::StateChanged& from, hairnet_event& event, std::string& text) {
  event.kind = HAIRNET_EVENT_STATE;
  event.state = state_of(from.state);
  event.is_refused = from.is_refused;
  event.wait_s = from.wait_s;
  text = from.detail;
}
template <class MemberEvent>
void write_member(hairnet_event_kind kind, const MemberEvent& from, hairnet_event& event) {
  event.kind = kind;
  // The number is that of the moment of the event: the member may have another one by now.
  event.member = from.number;
  event.character = from.member->own;
}
void write(const room::Joined& from, hairnet_event& event, std::string&) {
  write_member(HAIRNET_EVENT_JOINED, from, event);
}
void write(const room::Left& from, hairnet_event& event, std::string&) {
  write_member(HAIRNET_EVENT_LEFT, from, event);
}
void write(const room::Changed& from, hairnet_event& event, std::string&) {
  write_member(HAIRNET_EVENT_CHANGED, from, event);
}
void write(const room::WindChanged& from, hairnet_event& event, std::string&) {
  event.kind = HAIRNET_EVENT_WIND;
  event.session = from.session;
}
void write(const room::HeldChanged& from, hairnet_event& event, std::string&) {
  event.kind = HAIRNET_EVENT_HELD;
  event.member = from.member;
  event.hand = from.hand;
  // The field has 16 bits in the header; a larger count is cut, not wrapped.
  event.held = static_cast<std::uint16_t>(std::min<std::uint32_t>(from.point_count, 65'535));
}
void write(const room::PropsChanged&, hairnet_event& event, std::string&) {
  event.kind = HAIRNET_EVENT_PROPS;
}
void write(const room::TouchChanged& from, hairnet_event& event, std::string&) {
  event.kind = HAIRNET_EVENT_TOUCH;
  event.member = from.number;
}
void write(const room::Error& from, hairnet_event& event, std::string& text) {
  event.kind = HAIRNET_EVENT_ERROR;
  event.character = from.character;
  text = from.detail;
}

}  // namespace
}  // namespace hairnet::c

using namespace hairnet;

hairnet_error hairnet_connect(const hairnet_options* options, hairnet_room** room, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        // Copies the caller's options, filled up with defaults, so that the caller's struct may end here.
        const Result<hairnet_options> all =
            c::full_options<hairnet_options>(options, HAIRNET_OPTIONS, "HAIRNET_OPTIONS");
        if (!all) return c::refuse(HAIRNET_INVALID, all.error(), error, error_size);
        const Result<link::LinkCoreOptions> core = c::core_options(*all);
        if (!core) return c::refuse(HAIRNET_INVALID, core.error(), error, error_size);
        const Result<wire::Observe> observe = c::observe_of(*all);
        if (!observe) return c::refuse(HAIRNET_INVALID, observe.error(), error, error_size);
        auto made = std::make_unique<hairnet_room>();
        const hairnet_error code = c::connect(*all, *core, *observe, made->room, error, error_size);
        if (code != HAIRNET_OK) return code;
        // The welcome has come. The room takes it now, so that it is connected when this returns.
        made->room->advance();
        *room = made.release();
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

hairnet_error hairnet_open(const hairnet_options* options, int64_t now_ns, hairnet_room** room, char* error,
                           size_t error_size) {
  return c::guarded(
      [&] {
        const Result<hairnet_options> all =
            c::full_options<hairnet_options>(options, HAIRNET_OPTIONS, "HAIRNET_OPTIONS");
        if (!all) return c::refuse(HAIRNET_INVALID, all.error(), error, error_size);
        const Result<link::LinkCoreOptions> core = c::core_options(*all);
        if (!core) return c::refuse(HAIRNET_INVALID, core.error(), error, error_size);
        const Result<wire::Observe> observe = c::observe_of(*all);
        if (!observe) return c::refuse(HAIRNET_INVALID, observe.error(), error, error_size);
        auto made = std::make_unique<hairnet_room>();
        made->core = std::make_unique<link::LinkCore>(*core);
        auto conversation = std::make_unique<link::CoreConversation>(*made->core);
        // The room owns the conversation; the handle keeps a pointer, to tell it the time.
        made->conversation = conversation.get();
        made->conversation->set_now(now_ns);
        // The room sends its Observe to a core that has not started; the core stores it and sends it after its welcome.
        made->room = std::make_unique<room::Room>(std::move(conversation), *observe);
        made->core->start();
        *room = made.release();
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

void hairnet_close(hairnet_room* room) {
  c::guarded([&] {
    room->room->close();
    // The room is empty now, and so is its scene.
    c::show(*room);
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_room_free(hairnet_room* room) {
  if (room == nullptr) return;
  // The room speaks to the core until its end, so it goes first.
  room->room.reset();
  delete room;
}

hairnet_room_state hairnet_state(const hairnet_room* room) {
  return c::state_of(room->room->state());
}

uint64_t hairnet_session(const hairnet_room* room) {
  return room->room->session();
}

int32_t hairnet_may_set_wind(const hairnet_room* room) {
  return room->room->may_set_wind();
}

int32_t hairnet_next_event(hairnet_room* room, hairnet_event* event) {
  std::int32_t is_there = 0;
  c::guarded([&] {
    // Events are taken from the room in groups and handed out one by one.
    if (room->next_event == room->events.size()) {
      room->events = room->room->take_events();
      room->next_event = 0;
      if (room->events.empty()) return hairnet_error{HAIRNET_OK};
    }
    *event = {};
    room->event_text.clear();
    std::visit([&](const auto& e) { c::write(e, *event, room->event_text); }, room->events[room->next_event]);
    // The text lives in the handle until the next call, so that the caller has nothing to free.
    event->text = room->event_text.c_str();
    // An event for which memory was lacking comes at the next call.
    ++room->next_event;
    is_there = 1;
    return hairnet_error{HAIRNET_OK};
  });
  return is_there;
}

void hairnet_get_counters(const hairnet_room* room, hairnet_counters* counters) {
  const link::LinkCounters now = room->room->counters();
  hairnet_counters all = HAIRNET_COUNTERS;
  all.bytes_sent = now.bytes_sent;
  all.bytes_received = now.bytes_received;
  all.frames_received = now.frames_received;
  all.frames_dropped = now.frames_dropped;
  all.frames_undecodable = now.frames_undecodable;
  all.poses_dropped = now.poses_dropped;
  all.inputs_dropped = room->room->inputs_dropped();
  all.reconnects = now.reconnects;
  all.resumes = now.resumes;
  all.redirects = now.redirects;
  all.silent_servers = now.servers_silent;
  all.downloaded_bytes = now.downloads.bytes;
  all.download_byte_count = now.downloads.byte_count;
  // A caller of an older header has a smaller struct: only the fields that it knows are written.
  all.size = std::min(counters->size, sizeof all);
  std::memcpy(counters, &all, all.size);
}

void hairnet_poll(hairnet_room* room, int64_t now_ns) {
  // The clock of this conversation stands still between calls: each call that gets a time sets it before the core can
  // use it.
  room->conversation->set_now(now_ns);
  room->core->poll(now_ns);
}

int64_t hairnet_next_deadline(const hairnet_room* room) {
  return room->core->next_deadline_ns();
}

// A host of NULL means the address that the caller knows itself.
int32_t hairnet_wants_connection(const hairnet_room* room, const char** host, uint16_t* port) {
  const std::optional<wire::ServerAt>& elsewhere = room->core->redirected_to();
  // The text is the core's, and valid until the next call that may change its state.
  if (host != nullptr) *host = elsewhere ? elsewhere->host.c_str() : nullptr;
  if (port != nullptr) *port = elsewhere ? elsewhere->port : std::uint16_t{0};
  return room->core->wants_connection();
}

void hairnet_on_opening(hairnet_room* room, int64_t now_ns) {
  room->conversation->set_now(now_ns);
  room->core->on_opening(now_ns);
}

void hairnet_on_open(hairnet_room* room, int32_t has_datagrams, int64_t now_ns) {
  room->conversation->set_now(now_ns);
  room->core->on_open(now_ns, has_datagrams != 0);
}

void hairnet_on_bytes(hairnet_room* room, const void* bytes, size_t size, int64_t now_ns) {
  room->conversation->set_now(now_ns);
  room->core->on_bytes({static_cast<const std::uint8_t*>(bytes), size}, now_ns);
}

void hairnet_on_packet(hairnet_room* room, const void* bytes, size_t size, int64_t now_ns) {
  room->conversation->set_now(now_ns);
  room->core->on_packet({static_cast<const std::uint8_t*>(bytes), size}, now_ns);
}

void hairnet_on_closed(hairnet_room* room, const char* error, int64_t now_ns) {
  room->conversation->set_now(now_ns);
  room->core->on_closed(c::text_or_empty(error), now_ns);
}

const void* hairnet_take_packet(hairnet_room* room, int64_t now_ns, size_t* size, int32_t* may_be_lost) {
  room->conversation->set_now(now_ns);
  // The packet stays in the handle until the next call, so that the caller has nothing to free.
  room->packet = room->core->take_packet(now_ns);
  *size = room->packet.size();
  if (may_be_lost != nullptr) *may_be_lost = room->core->taken_may_be_lost();
  return room->packet.empty() ? nullptr : room->packet.data();
}

int32_t hairnet_wants_half_close(const hairnet_room* room) {
  return room->core->wants_half_close();
}

int32_t hairnet_wants_close(const hairnet_room* room) {
  return room->core->wants_close();
}

int32_t hairnet_replace_connection(hairnet_room* room, const char* error, int64_t now_ns) {
  room->conversation->set_now(now_ns);
  return room->core->replace_connection(c::text_or_empty(error), now_ns);
}

hairnet_error hairnet_add_character(hairnet_room* room, const hairnet_groom* groom,
                                    const hairnet_character_options* options, uint32_t* own, char* error,
                                    size_t error_size) {
  return c::guarded(
      [&] {
        const Result<room::CharacterOptions> wanted = c::character_options_of(options);
        if (!wanted) return c::refuse(HAIRNET_INVALID, wanted.error(), error, error_size);
        const Result<std::uint32_t> number = room->room->add_character(groom->file, *wanted, groom->groom);
        if (number && own != nullptr) *own = *number;
        return c::done_or_error(number, error, error_size);
      },
      error, error_size);
}

hairnet_error hairnet_remove_character(hairnet_room* room, uint32_t own) {
  return c::guarded([&] {
    if (c::own_room(room, own) == nullptr) return hairnet_error{HAIRNET_NOT_THERE};
    room->room->remove_character(own);
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_push_pose(hairnet_room* room, uint32_t own, const double pose[HAIRNET_POSE_NUMBERS],
                                int32_t teleport) {
  const std::uint8_t jumps = teleport != 0;
  return hairnet_push_poses(room, &own, pose, &jumps, 1);
}

hairnet_error hairnet_push_poses(hairnet_room* room, const uint32_t* own, const double* poses, const uint8_t* teleports,
                                 size_t count) {
  return c::guarded([&] {
    std::vector<room::OwnPose> pushed(count);
    bool are_there = true;
    for (std::size_t i = 0; i < count; ++i) {
      // A number that is not there is passed over by the room, so one wrong number does not keep the other poses back.
      pushed[i] = {own[i], c::pose_of(poses + i * HAIRNET_POSE_NUMBERS), teleports != nullptr && teleports[i] != 0};
      are_there = are_there && c::own_room(room, own[i]) != nullptr;
    }
    // Valid poses of the call are sent even if others are refused.
    if (!room->room->push(pushed)) return hairnet_error{HAIRNET_INVALID};
    return hairnet_error{are_there ? HAIRNET_OK : HAIRNET_NOT_THERE};
  });
}

hairnet_error hairnet_set_level(hairnet_room* room, uint32_t own, hairnet_level level) {
  // An enum of C may hold any integer; the conversion makes negative ones large.
  if (static_cast<unsigned>(level) > HAIRNET_RIGID) return HAIRNET_INVALID;
  return c::guarded([&] {
    if (c::own_room(room, own) == nullptr) return hairnet_error{HAIRNET_NOT_THERE};
    room->room->set_level(own, static_cast<LevelIndex>(level));
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_set_appearance(hairnet_room* room, uint32_t own, const char* tag, size_t tag_size,
                                     const hairnet_appearance* appearance, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        if (c::own_room(room, own) == nullptr) return c::no_such_character(error, error_size);
        const Result<std::optional<wire::Appearance>> wanted = c::checked(appearance);
        if (!wanted) return c::refuse(HAIRNET_INVALID, wanted.error(), error, error_size);
        return c::done_or_error(room->room->set_appearance(own, c::tag_of(tag, tag_size), *wanted), error, error_size);
      },
      error, error_size);
}

hairnet_error hairnet_set_material(hairnet_room* room, uint32_t own, const hairnet_material* material, char* error,
                                   size_t error_size) {
  return c::guarded(
      [&] {
        if (c::own_room(room, own) == nullptr) return c::no_such_character(error, error_size);
        return c::done_or_error(room->room->set_material(own, c::scale_of(*material)), error, error_size);
      },
      error, error_size);
}

hairnet_error hairnet_set_wind(hairnet_room* room, const hairnet_wind* wind, char* error, size_t error_size) {
  return c::guarded([&] { return c::done_or_error(room->room->set_wind(c::wind_of(*wind)), error, error_size); }, error,
                    error_size);
}

void hairnet_get_wind(const hairnet_room* room, hairnet_wind* wind) {
  *wind = c::wind_of(room->room->wind());
}

void hairnet_report_importance(hairnet_room* room, const hairnet_importance* members, size_t count) {
  c::guarded([&] {
    std::vector<wire::MemberImportance> all;
    for (std::size_t i = 0; i < count; ++i) {
      all.push_back({members[i].member, members[i].screen_height, members[i].in_view != 0});
    }
    room->room->report_importance(std::move(all));
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_fetch_first(hairnet_room* room, uint32_t member, int32_t only) {
  // Member numbers begin at 1.
  room->room->fetch_first(member == 0 ? std::nullopt : std::optional(member), only != 0);
}

hairnet_error hairnet_moderate(hairnet_room* room, hairnet_moderation action, uint32_t member, const char* subject,
                               uint32_t seconds, const char* reason, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        if (static_cast<unsigned>(action) > HAIRNET_UNLOCK)
          return c::refuse(HAIRNET_INVALID, "moderate: there is no such action", error, error_size);
        wire::Moderate order{static_cast<wire::ModerateAction>(action), 0, c::text_or_empty(subject), seconds,
                             c::text_or_empty(reason)};
        if (member != 0) {
          const auto found = room->room->members().find(member);
          if (found == room->room->members().end())
            return c::refuse(HAIRNET_NOT_THERE, "moderate: there is no such member", error, error_size);
          // The protocol names a person by a session: a member number may pass to somebody else before the message
          // arrives.
          order.session = found->second->session;
        }
        room->room->moderate(order);
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

void hairnet_advance(hairnet_room* room) {
  c::guarded([&] {
    room->room->advance();
    c::show(*room);
    return hairnet_error{HAIRNET_OK};
  });
}

const hairnet_scene* hairnet_room_scene(const hairnet_room* room) {
  return &room->scene;
}
