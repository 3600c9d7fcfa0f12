import { expect, it } from "vitest";
import { HairnetError } from "../../src/module/hairnetError";
import { hostAndPort, urlAt, webSocketUrl } from "../../src/net/url";

it("is that of the WebSocket of a host, a page and itself", () => {
  expect(webSocketUrl("myhost:7420")).toBe("ws://myhost:7420/ws");
  expect(webSocketUrl("http://localhost:7420/room.html?x=1")).toBe("ws://localhost:7420/ws");
  expect(webSocketUrl("https://a.b/")).toBe("wss://a.b/ws");
  expect(webSocketUrl("ws://[::1]:7420/other")).toBe("ws://[::1]:7420/other");
  for (const bad of ["ftp://a", "http://"]) expect(() => webSocketUrl(bad)).toThrow(HairnetError);
});

it("leads to another server by the same kind of address", () => {
  const home = "wss://hair-1:7420/hair/ws";
  expect(urlAt(home, "hair-2", 7421)).toBe("wss://hair-2:7421/hair/ws");
  expect(urlAt(home, "2001:db8::1", 7421)).toBe("wss://[2001:db8::1]:7421/hair/ws");
  expect(() => urlAt(home, "no:address", 7421)).toThrow(TypeError);
});

it("names its port to people, also the scheme's own", () => {
  expect(hostAndPort("ws://hair:7420/ws")).toBe("hair:7420");
  expect(hostAndPort("ws://hair/ws")).toBe("hair:80");
  expect(hostAndPort("wss://hair/ws")).toBe("hair:443");
});
