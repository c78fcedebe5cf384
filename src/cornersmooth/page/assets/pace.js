// When pictures are drawn, and how much of the path in each: less while they change, where drawing all of it is slow.

/** Milliseconds for a picture that moves well, and that a picture at rest may take before it has fewer pixels. */
const SMOOTH = 45;
const PATIENT = 900;
/** Milliseconds of rest before everything is drawn. */
const REST = 300;
/** Pictures in a row by which the pace is judged. */
const JUDGED = 4;

class Pace {
  /**
   * @param {number} levels of coarseness beside the whole, which is level 0
   * @param {(level: number, still: boolean) => void} draw
   * @param {() => void} finish waits until a picture is there
   */
  constructor(levels, draw, finish) {
    this.levels = levels;
    this.draw = draw;
    this.finish = finish;
    /** Level of pictures that move. */
    this.level = 0;
    this.waiting = false;
    /** Whether the last picture was of everything, and none is to come. */
    this.still = false;
    this.rest = 0;
    this.wholes = 0;
    /** Milliseconds of the last picture at rest. */
    this.whole = 0;
    this.last = 0;
    /** @type {number[]} */
    this.gaps = [];
  }

  /** Draws soon, once a frame however often it is asked; everything after a rest. */
  touch() {
    this.still = false;
    clearTimeout(this.rest);
    if (this.wholes < 2) {
      // the first pictures are of everything: the second tells how slow that is, the first makes buffers and programs
      this.rest = setTimeout(() => this.drawWhole(), 0);
      return;
    }
    this.rest = setTimeout(() => this.drawWhole(), REST);
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      this.judge(now);
      this.draw(this.level, false);
    });
  }

  drawWhole() {
    requestAnimationFrame(() => {
      if (this.waiting) return;
      const begin = performance.now();
      this.draw(0, true);
      this.finish();
      this.whole = performance.now() - begin;
      this.last = 0;
      this.wholes++;
      if (this.wholes === 1) this.drawWhole();
      else {
        if (this.whole < SMOOTH / 2) this.level = 0;
        else if (this.whole > SMOOTH) this.level = Math.max(this.level, 1);
        this.still = true;
      }
    });
  }

  /** Takes a coarser level where pictures follow each other slowly. @param {number} now */
  judge(now) {
    if (this.last && now - this.last < 1000) this.gaps.push(now - this.last);
    else this.gaps = [];
    this.last = now;
    if (this.gaps.length < JUDGED) return;
    const slow = this.gaps.every((gap) => gap > SMOOTH);
    if (slow && this.level < this.levels) this.level++;
    this.gaps = [];
  }
}
