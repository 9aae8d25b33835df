/* Pages opened from a folder (file://) may not start workers: the search runs in a hidden frame instead. */
"use strict";

if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe"), waiting = [];
      this.postMessage = (data) => waiting.push(data);
      frame.hidden = true;
      frame.title = "Search";
      document.body.append(frame);
      const inside = frame.contentWindow;
      inside.postMessage = (data) => {
        const event = new MessageEvent("message", { data });
        this.dispatchEvent(event);
        if (this.onmessage) this.onmessage(event);
      };
      const load = (source) => new Promise((done, failed) => {
        const script = inside.document.createElement("script");
        Object.assign(script, { src: source, onload: done, onerror: failed });
        inside.document.body.append(script);
      });
      inside.importScripts = (...sources) =>
        sources.reduce((last, source) => last.then(() => load(new URL(source, url).href)), Promise.resolve());
      load(url).then(() => {
        this.postMessage = (data) => {
          const event = new MessageEvent("message", { data });
          inside.dispatchEvent(event);
        };
        waiting.splice(0).forEach((data) => this.postMessage(data));
      });
    }

    terminate() {}
  };
}
