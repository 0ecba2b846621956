"""HTTP and WebSocket: routers, schemas, the guard around them, errors as answers."""
