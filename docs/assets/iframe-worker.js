/* The search runs in a worker, which browsers do not start on pages opened from the disk. There, and only there,
   an empty hidden frame runs the same script in its place. */
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const address = new URL(url, location.href).href;
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.inside = frame.contentWindow;
      this.inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      this.inside.importScripts = (...urls) =>
        Promise.all(
          urls.map(
            (one) =>
              new Promise((loaded, failed) => {
                const script = frame.contentDocument.createElement("script");
                script.src = new URL(one, address).href;
                script.async = false;
                script.onload = loaded;
                script.onerror = failed;
                frame.contentDocument.head.append(script);
              }),
          ),
        );
      this.loaded = this.inside.importScripts(address);
    }

    postMessage(data) {
      this.loaded.then(() => this.inside.dispatchEvent(new MessageEvent("message", { data })));
    }
  };
}
