// What bench.walk runs inside the page: frames drawn and waited for, one after another.

window.bench = {
  /** Wait until nothing is being loaded. */
  async rest() {
    const { session } = farfield;
    session.stop();
    for (let calm = 0; calm < 5; ) {
      session.draw();
      await farfield.nextFrame();
      calm = session.walk.idle && session.walk.stats.uploads === 0 ? calm + 1 : 0;
    }
  },

  /** Milliseconds of one frame, its pixels waited for. */
  frame(mode, pose) {
    const { session } = farfield;
    const gl = session.renderer.getContext();
    session.comparison.mode = mode;
    session.place({ eye: pose.slice(0, 3), yaw: pose[3], pitch: pose[4] });
    const start = performance.now();
    session.draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now() - start;
  },

  /** The walk's and the full model's frames from the same places in turn, best of `rounds` each. */
  async pairs(cells, rounds) {
    const walk = [];
    const full = [];
    for (const poses of cells) {
      farfield.session.comparison.mode = 'walk';
      const [x, y, z, yaw, pitch] = poses[0];
      await farfield.goTo(x, y, z, yaw, pitch);
      await bench.rest();
      for (const mode of ['walk', 'full', 'full']) bench.frame(mode, poses[0]);
      for (const pose of poses) {
        const best = { walk: Infinity, full: Infinity };
        for (let n = 0; n < rounds; n++) {
          for (const mode of n % 2 ? ['full', 'walk'] : ['walk', 'full']) {
            best[mode] = Math.min(best[mode], bench.frame(mode, pose));
          }
        }
        walk.push(best.walk);
        full.push(best.full);
      }
    }
    return { walk, full };
  },

  /**
   * Follow `poses` from place `at` on for so many frames, as a walker does who waits for cells that
   * have not come. What each frame took, showed and held; with `both` also the full model's time.
   */
  async follow(poses, at, frames, both = false) {
    const { session } = farfield;
    const { walk } = session;
    session.stop();
    const log = [];
    for (let n = 0; n < frames && at < poses.length; n++) {
      const busy = !walk.idle || walk.stats.uploads > 0;
      const ms = bench.frame('walk', poses[at]);
      const { stats } = walk;
      const full = both ? bench.frame('full', poses[at]) : undefined;
      log.push({
        at,
        ms,
        full,
        busy,
        cell: stats.cell,
        wanted: walk.wanted?.cell.name,
        quads: stats.quads,
        near: stats.nearTriangles,
        drawCalls: stats.drawCalls.far,
        bytes: stats.textureBytes,
        cap: stats.textureCap,
      });
      await farfield.nextFrame();
      const next = poses[at + 1];
      if (next === undefined || session.brake(next.slice(0, 3)) > 0) at++;
    }
    return { log, at };
  },
};
