"""Pages in the browser: the viewer of a transport, and the preview of a camera."""
