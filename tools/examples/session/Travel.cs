// SPDX-License-Identifier: MIT
// Travels through a set that `filiform serve` serves, without a solver of its own. Copy the class Filiform into Unity:
// call Connect once, Hand every frame with the position of the controller, and read Proxy and ForceAt. Alone:
//   mcs Travel.cs && mono Travel.exe ws://127.0.0.1:7878/v1/session SET
using System;
using System.IO;
using System.Net.WebSockets;
using System.Text;
using System.Threading;
using System.Threading.Tasks;

public class Filiform {
  readonly ClientWebSocket socket = new ClientWebSocket();
  readonly object newest = new object();
  uint sent, received;
  public double[] Proxy = new double[3];  // um
  public uint Cell, Proxies, Models;
  float[] m;  // h_D, force_N, stiffness xx xy xz yy yz zz
  public async Task Connect(string url, string set, double[] at_um, string token = null) {
    socket.Options.AddSubProtocol("filiform.v1");
    if (token != null) socket.Options.SetRequestHeader("Authorization", "Bearer " + token);
    await socket.ConnectAsync(new Uri(url), CancellationToken.None);
    await Ask("hello", "{\"client\":\"Travel.cs\"}");
    await Ask("open", string.Format(System.Globalization.CultureInfo.InvariantCulture,
              "{{\"set\":\"{0}\",\"at\":[{1},{2},{3}]}}", set, at_um[0], at_um[1], at_um[2]));
    await Ask("subscribe", "{\"model_Hz\":20}");
    _ = Listen();
  }
  async Task Ask(string method, string parameters) {  // before Listen only: waits for the answer
    byte[] text = Encoding.UTF8.GetBytes("{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"" + method + "\",\"params\":" + parameters + "}");
    await socket.SendAsync(new ArraySegment<byte>(text), WebSocketMessageType.Text, true, CancellationToken.None);
    for (;;) {
      var frame = await Receive();
      if (frame.Item1 != WebSocketMessageType.Text) continue;
      string answer = Encoding.UTF8.GetString(frame.Item2);
      if (answer.Contains("\"error\"")) throw new Exception(answer);
      if (answer.Contains("\"id\"")) return;
    }
  }
  async Task<Tuple<WebSocketMessageType, byte[]>> Receive() {
    var whole = new MemoryStream();
    var part = new byte[65536];
    for (;;) {
      var got = await socket.ReceiveAsync(new ArraySegment<byte>(part), CancellationToken.None);
      if (got.MessageType == WebSocketMessageType.Close) throw new Exception("closed: " + got.CloseStatusDescription);
      whole.Write(part, 0, got.Count);
      if (got.EndOfMessage) return Tuple.Create(got.MessageType, whole.ToArray());
    }
  }
  async Task Listen() {
    for (;;) {
      var frame = await Receive();
      if (frame.Item1 == WebSocketMessageType.Binary) lock (newest) Take(frame.Item2);
    }
  }
  void Take(byte[] f) {
    if (f[0] == 2) {
      ++Proxies;
      received = BitConverter.ToUInt32(f, 4);
      for (int i = 0; i < 3; ++i) Proxy[i] = BitConverter.ToDouble(f, 24 + 8 * i);
      Cell = BitConverter.ToUInt32(f, 72);
    } else if (f[0] == 3) {
      ++Models;
      m = new float[12];
      for (int i = 0; i < 3; ++i) m[i] = (float)BitConverter.ToDouble(f, 16 + 8 * i);
      for (int i = 3; i < 12; ++i) m[i] = BitConverter.ToSingle(f, 40 + 4 * (i - 3));
    }
  }
  public double[] ForceAt(double x_m, double y_m, double z_m) {  // N, until the next answer; limit its rise, and its age to 0.1 s
    lock (newest) {
      if (m == null) return new double[3];
      double x = x_m - m[0], y = y_m - m[1], z = z_m - m[2];
      return new[] { m[3] - m[6] * x - m[7] * y - m[8] * z, m[4] - m[7] * x - m[9] * y - m[10] * z,
                     m[5] - m[8] * x - m[10] * y - m[11] * z };
    }
  }
  public Task Hand(double x_m, double y_m, double z_m) {  // one frame of 64 bytes; await it before the next
    var f = new byte[64];
    f[0] = f[2] = 1;
    BitConverter.GetBytes(++sent).CopyTo(f, 4);
    BitConverter.GetBytes(DateTime.UtcNow.Ticks * 100).CopyTo(f, 8);
    BitConverter.GetBytes(x_m).CopyTo(f, 16);
    BitConverter.GetBytes(y_m).CopyTo(f, 24);
    BitConverter.GetBytes(z_m).CopyTo(f, 32);
    lock (newest) BitConverter.GetBytes(received).CopyTo(f, 40);
    return socket.SendAsync(new ArraySegment<byte>(f), WebSocketMessageType.Binary, true, CancellationToken.None);
  }
  public static void Main(string[] a) {
    var travel = new Filiform();
    travel.Connect(a[0], a[1], new double[3], Environment.GetEnvironmentVariable("FILIFORM_TOKEN")).Wait();
    for (int i = 0; i < 200; ++i) {
      travel.Hand(0.01 * Math.Sin(i * 0.03), 0.01 * (1 - Math.Cos(i * 0.03)), 0).Wait();
      Thread.Sleep(10);
    }
    lock (travel.newest)
      Console.WriteLine("{0} PROXY, {1} LOCAL MODEL, {2:F3} N along x", travel.Proxies, travel.Models, travel.ForceAt(0, 0, 0)[0]);
    Environment.Exit(0);
  }
}
