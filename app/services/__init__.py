"""What the server does, without a word of HTTP; routers call this, this calls storage and jobs."""
